//! Deep deterministic policy gradient.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::adam::Trained;
use super::algorithm::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use super::algorithm_settings::DdpgSettings;
use super::critic::{Gradients, debug_settings, evaluate, regress};
use super::error::TrainError;
use super::network::{Network, Shape};
use super::pass::Pass;
use crate::tanh::tanh;
use crate::trained::LayerWeights;

/// Deep deterministic policy gradient: a critic learns the value of actions, and an actor learns
/// actions of the highest value.
///
/// Source: Lillicrap et al., *Continuous control with deep reinforcement learning*, 2016. As in
/// openai/baselines, actor and critic take their steps at the same time.
pub struct Ddpg {
    settings: DdpgSettings,
    /// The lowest and the highest target; infinite if nothing is clipped.
    target_bounds: [f32; 2],
    networks: Networks,
    /// Of the critic and of the actor, and the losses: the critic's, the actor's and the value.
    gradients: Gradients<3>,
    critic_work: Work,
    actor_work: Work,
    num_updates: u64,
}

struct Networks {
    actor: Trained,
    critic: Trained,
    target_actor: Network,
    target_critic: Network,
    averaged_actor: Network,
}

debug_settings!(Ddpg);

/// What a gradient is computed with; passes and vectors are reused.
#[derive(Default)]
struct Work {
    actor: Pass,
    critic: Pass,
    actions: Vec<f32>,
    targets: Vec<f32>,
}

impl Ddpg {
    /// Creates networks, whose first weights `init.seed` decides.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, `init.num_actions` is not from 1 to 1,024, or `init.reward_bounds` is empty.
    pub fn new(settings: DdpgSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let clipped = init.return_bounds(settings.gamma);
        let AlgorithmInit { num_inputs, num_actions, seed, .. } = init;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let DdpgSettings { hidden, layer_norm, last_layer_scale, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Shape::new(num_inputs + num_actions, hidden, 1, *layer_norm);
        let critic = Network::init(critic, 1.0, &mut rng);
        Ok(Self {
            gradients: Gradients::new([critic.parameters.len(), actor.parameters.len(), 3]),
            networks: Networks {
                averaged_actor: actor.clone(),
                target_actor: actor.clone(),
                target_critic: critic.clone(),
                actor: Trained::new(actor, settings.actor_learning_rate),
                critic: Trained::new(critic, settings.critic_learning_rate),
            },
            critic_work: Work::default(),
            actor_work: Work::default(),
            num_updates: 0,
            target_bounds: match settings.clip_targets {
                true => clipped,
                false => [f32::NEG_INFINITY, f32::INFINITY],
            },
            settings,
        })
    }
}

impl Algorithm for Ddpg {
    fn name(&self) -> &str {
        "ddpg"
    }

    fn gamma(&self) -> f64 {
        self.settings.gamma
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let Work { actor: pass, actions: greedy, .. } = &mut self.actor_work;
        act(pass, &self.networks.actor.network, inputs, greedy);
        for ((action, greedy), noise) in actions.iter_mut().zip(greedy).zip(noise) {
            *action = noise.mul_add(self.settings.noise, *greedy).clamp(-1.0, 1.0);
        }
    }

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        let Self { settings, networks, gradients, critic_work, actor_work, .. } = self;
        let (target_bounds, num_updates) = (self.target_bounds, &mut self.num_updates);
        let [critic_gradient, actor_gradient, losses] = gradients.parts_mut();
        let ((critic_loss, value), actor_loss) = rayon::join(
            || networks.critic_gradient(batch, target_bounds, critic_work, critic_gradient),
            || networks.actor_gradient(batch, settings, actor_work, actor_gradient),
        );
        losses.copy_from_slice(&[critic_loss, actor_loss, value]);
        average(&mut gradients.numbers);

        let [critic_gradient, actor_gradient, losses] = gradients.parts_mut();
        let Networks { actor, critic, target_actor, target_critic, averaged_actor } = networks;
        *num_updates += 1;
        let rate_factor = settings.rate_factor(*num_updates);
        let follows = num_updates.is_multiple_of(settings.target_interval);
        let step = |trained: &mut Trained, target: &mut Network, gradient: &[f32]| {
            trained.step(*num_updates, rate_factor, gradient);
            if follows {
                target.follow(&trained.network, settings.target_fraction);
            }
        };
        rayon::join(
            || step(critic, target_critic, critic_gradient),
            || {
                step(actor, target_actor, actor_gradient);
                averaged_actor.follow(&actor.network, settings.average_fraction);
            },
        );
        Losses::new(losses[0], losses[1], losses[2])
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.networks.averaged_actor.layer_weights()
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let networks = &mut self.networks;
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        networks.actor.push_to("actor", &mut state);
        networks.critic.push_to("critic", &mut state);
        networks.target_actor.push_to("target_actor", &mut state);
        networks.target_critic.push_to("target_critic", &mut state);
        networks.averaged_actor.push_to("averaged_actor", &mut state);
        state
    }
}

impl Networks {
    /// Computes the gradient of the critic's loss: its mean squared error against the reward and
    /// the discounted value of the next state. Returns the loss and the mean value.
    fn critic_gradient(
        &self,
        batch: Transitions<'_>,
        [lowest, highest]: [f32; 2],
        work: &mut Work,
        gradient: &mut [f32],
    ) -> (f32, f32) {
        let Work { actor, critic, actions, targets } = work;
        act(actor, &self.target_actor, batch.next_input, actions);
        let values = evaluate(critic, &self.target_critic, batch.next_input, actions);
        let rows = batch.reward.iter().zip(batch.discount).zip(values);
        targets.clear();
        let target = |((reward, discount), value)| reward + discount * value;
        targets.extend(rows.map(|row| target(row).clamp(lowest, highest)));
        regress(critic, &self.critic.network, batch, targets, gradient)
    }

    /// Computes the gradient of the actor's loss: the negative mean value of its actions, their
    /// mean square times `action_l2`, and the imitation of demonstrated ones. Returns the loss.
    fn actor_gradient(
        &self,
        batch: Transitions<'_>,
        settings: &DdpgSettings,
        work: &mut Work,
        gradient: &mut [f32],
    ) -> f32 {
        let (actor, critic) = (&self.actor.network, &self.critic.network);
        act(&mut work.actor, actor, batch.input, &mut work.actions);
        let actions = &work.actions;
        let values = evaluate(&mut work.critic, critic, batch.input, actions);
        let (share, num_actions) = (batch.share(), batch.num_actions());
        let weight = settings.action_l2 * share / num_actions as f32;
        let squares = actions.iter().map(|action| action * action).sum::<f32>();
        let mut loss = weight * squares - values.iter().sum::<f32>() * share;
        let imitation = settings.imitation_weight * share / num_actions as f32;
        // `None` if there is nothing to imitate.
        let difference = |index: usize| {
            let imitates = imitation > 0.0 && batch.demonstrated[index / num_actions];
            imitates.then(|| actions[index] - batch.action[index])
        };
        for difference in (0..actions.len()).filter_map(difference) {
            loss += imitation * difference * difference;
        }

        let by_action = work.critic.backward(critic, |_, _| -share, None, num_actions);
        let by_output = |index: usize, _| {
            let action = actions[index];
            let mut slope = by_action[index] + 2.0 * weight * action;
            if let Some(difference) = difference(index) {
                slope += 2.0 * imitation * difference;
            }
            slope * (1.0 - action * action)
        };
        work.actor.backward(actor, by_output, Some(gradient), 0);
        loss
    }
}

/// Computes the actions of an actor, a row for each input.
fn act(pass: &mut Pass, actor: &Network, inputs: &[f32], actions: &mut Vec<f32>) {
    actions.clear();
    actions.extend(pass.run(actor, inputs).iter().map(|output| tanh(*output)));
}
