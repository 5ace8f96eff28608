//! Deep deterministic policy gradient.

use super::critic::{Gradients, debug_settings};
use super::interface::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use crate::learn::error::TrainError;
use crate::learn::settings::algorithm::DdpgSettings;
use crate::network::adam::Trained;
use crate::network::pass::Pass;
use crate::network::perceptron::{Network, Shape};
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
    /// The gradients of the critic and of the actor, and means: the losses of both, the value and
    /// the target.
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

/// The largest factor by which an advantage multiplies imitation, as in Yang et al.
const HIGHEST_FACTOR: f32 = 10.0;

/// The passes and vectors that a gradient is computed with; they are reused.
#[derive(Default)]
struct Work {
    actor: Pass,
    critic: Pass,
    actions: Vec<f32>,
    targets: Vec<f32>,
    /// How strongly each transition is imitated.
    imitation: Vec<f32>,
}

impl Ddpg {
    /// Creates networks with initial weights that `init.seed` determines.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, `init.num_actions` is not from 1 to 1,024, or `init.reward_bounds` is empty.
    pub fn new(settings: DdpgSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let clipped = init.return_bounds(settings.gamma);
        let AlgorithmInit { num_inputs, num_actions, .. } = init;
        let mut rng = init.weights_rng();
        let DdpgSettings { hidden, layer_norm, last_layer_scale, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Shape::new(num_inputs + num_actions, hidden, 1, *layer_norm);
        let critic = Network::init(critic, 1.0, &mut rng);
        Ok(Self {
            gradients: Gradients::new([critic.parameters.len(), actor.parameters.len(), 4]),
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
        let ([critic_loss, value], actor_loss) = rayon::join(
            || networks.critic_gradient(batch, target_bounds, critic_work, critic_gradient),
            || networks.actor_gradient(batch, settings, actor_work, actor_gradient),
        );
        let target = critic_work.targets.iter().sum::<f32>() * batch.share();
        losses.copy_from_slice(&[critic_loss, actor_loss, value, target]);
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

    fn diagnostics(&self) -> Vec<(&'static str, f32)> {
        let ([critic, actor, _], means) = self.gradients.norms();
        vec![("target", means[3]), ("critic_gradient_norm", critic), ("actor_gradient_norm", actor)]
    }

    fn value_slopes(&mut self, inputs: &[f32], actions: &mut [f32]) -> Option<f32> {
        let (pass, critic) = (&mut self.actor_work.critic, &self.networks.critic.network);
        let values = pass.run_joined(critic, inputs, actions);
        let (share, num_actions) = (1.0 / values.len() as f32, actions.len() / values.len());
        let value = values.iter().sum::<f32>() * share;
        actions.copy_from_slice(pass.backward(critic, |_, _| share, None, num_actions));
        Some(value)
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.networks.averaged_actor.layer_weights()
    }

    fn set_greedy_layers(&mut self, layers: &[LayerWeights]) -> bool {
        let Networks { actor, target_actor, averaged_actor, .. } = &mut self.networks;
        for network in [&mut actor.network, target_actor, averaged_actor] {
            network.set_layer_weights(layers);
        }
        true
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let networks = &mut self.networks;
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        state.push("actor", networks.actor.vectors_mut());
        state.push("critic", networks.critic.vectors_mut());
        state.push("target_actor", networks.target_actor.vectors_mut());
        state.push("target_critic", networks.target_critic.vectors_mut());
        state.push("averaged_actor", networks.averaged_actor.vectors_mut());
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
    ) -> [f32; 2] {
        let Work { actor, critic, actions, targets, .. } = work;
        act(actor, &self.target_actor, batch.next_actor_input, actions);
        let values = critic.run_joined(&self.target_critic, batch.next_input, actions);
        targets.clear();
        let all = batch.targets(values.iter().copied());
        targets.extend(all.map(|target| target.clamp(lowest, highest)));
        batch.regress(critic, &self.critic.network, targets, gradient)
    }

    /// Computes the gradient of the actor's loss: the negative mean value of its actions times
    /// `value_weight`, their mean square times `action_l2`, and the imitation of demonstrated ones.
    /// Returns the loss.
    fn actor_gradient(
        &self,
        batch: Transitions<'_>,
        settings: &DdpgSettings,
        work: &mut Work,
        gradient: &mut [f32],
    ) -> f32 {
        let (actor, critic) = (&self.actor.network, &self.critic.network);
        let Work { actor: actor_pass, critic: critic_pass, actions, imitation, .. } = work;
        act(actor_pass, actor, batch.actor_input, actions);
        let DdpgSettings { value_weight, imitation_weight, advantage_factor, .. } = *settings;
        let weighs_advantages = imitation_weight > 0.0 && advantage_factor > 0.0;
        imitation.clear();
        if weighs_advantages {
            imitation.extend(critic_pass.run_joined(critic, batch.input, batch.action));
        }
        let values = critic_pass.run_joined(critic, batch.input, actions);
        if weighs_advantages {
            for (value, own) in imitation.iter_mut().zip(values) {
                *value = libm::expf(advantage_factor * (*value - own)).min(HIGHEST_FACTOR);
            }
        } else {
            imitation.resize(batch.len, 1.0);
        }
        let (share, num_actions) = (batch.share(), batch.num_actions());
        for (weight, is_demonstrated) in imitation.iter_mut().zip(batch.demonstrated) {
            let weighs = if *is_demonstrated { imitation_weight } else { 0.0 };
            *weight *= weighs * share / num_actions as f32;
        }
        let (actions, imitation) = (&*actions, &*imitation);
        let weight = settings.action_l2 * share / num_actions as f32;
        let squares = actions.iter().map(|action| action * action).sum::<f32>();
        let value_share = value_weight * share;
        let mut loss = weight * squares - values.iter().sum::<f32>() * value_share;
        // `None` if there is nothing to imitate.
        let imitated = |index: usize| {
            let weight = imitation[index / num_actions];
            (weight > 0.0).then(|| (weight, actions[index] - batch.action[index]))
        };
        for (weight, difference) in (0..actions.len()).filter_map(imitated) {
            loss += weight * difference * difference;
        }

        let by_action = critic_pass.backward(critic, |_, _| -value_share, None, num_actions);
        let by_output = |index: usize, _| {
            let action = actions[index];
            let mut slope = by_action[index] + 2.0 * weight * action;
            if let Some((weight, difference)) = imitated(index) {
                slope += 2.0 * weight * difference;
            }
            slope * (1.0 - action * action)
        };
        actor_pass.backward(actor, by_output, Some(gradient), 0);
        loss
    }
}

/// Computes the actions of an actor, a row for each input.
fn act(pass: &mut Pass, actor: &Network, inputs: &[f32], actions: &mut Vec<f32>) {
    actions.clear();
    actions.extend(pass.run(actor, inputs).iter().map(|output| tanh(*output)));
}

#[cfg(test)]
mod tests {
    use super::*;

    const INPUT: [f32; 6] = [0.3, -0.8, 0.5, -0.2, 0.9, 0.1];
    const ACTION: [f32; 4] = [0.7, -0.4, -0.6, 0.2];

    fn ddpg(settings: DdpgSettings) -> Ddpg {
        let settings = DdpgSettings { hidden: vec![9, 7], last_layer_scale: 1.0, ..settings };
        let reward_bounds = -1.0..=0.0;
        let init = AlgorithmInit { num_inputs: 3, num_actions: 2, reward_bounds, seed: 5, rank: 0 };
        Ddpg::new(settings, init).expect("the settings are in their ranges")
    }

    /// Returns the loss of the actor and its gradient for the first `len` of two transitions.
    fn gradient(ddpg: &Ddpg, len: usize, demonstrated: &[bool]) -> (f32, Vec<f32>) {
        let batch = Transitions {
            len,
            input: &INPUT[..3 * len],
            actor_input: &INPUT[..3 * len],
            action: &ACTION[..2 * len],
            reward: &[-1.0; 2][..len],
            discount: &[0.9; 2][..len],
            next_input: &INPUT[..3 * len],
            next_actor_input: &INPUT[..3 * len],
            demonstrated,
            ..Transitions::default()
        };
        let actor = &ddpg.networks.actor.network;
        let mut gradient = vec![f32::NAN; actor.parameters.len()];
        let (work, settings) = (&mut Work::default(), &ddpg.settings);
        let loss = ddpg.networks.actor_gradient(batch, settings, work, &mut gradient);
        (loss, gradient)
    }

    #[test]
    fn the_gradient_of_the_actor_agrees_with_differences_of_its_loss() {
        let mut ddpg = ddpg(DdpgSettings {
            action_l2: 0.3,
            value_weight: 0.7,
            imitation_weight: 2.0,
            ..DdpgSettings::default()
        });
        let demonstrated = [true, false];
        let (_, computed) = gradient(&ddpg, 2, &demonstrated);
        let step = 1e-2;
        for (index, computed) in computed.into_iter().enumerate() {
            let [high, low] = [step, -step].map(|step| {
                let parameters = &mut ddpg.networks.actor.network.parameters;
                let before = parameters[index];
                parameters[index] += step;
                let (loss, _) = gradient(&ddpg, 2, &demonstrated);
                ddpg.networks.actor.network.parameters[index] = before;
                loss
            });
            let difference = (high - low) / (2.0 * step);
            assert!((computed - difference).abs() < 2e-3, "{index}: {computed} {difference}");
        }
    }

    /// The loss is imitation alone here.
    #[test]
    fn an_action_is_imitated_the_more_the_better_it_is() {
        let imitating = |advantage_factor| {
            ddpg(DdpgSettings {
                action_l2: 0.0,
                value_weight: 0.0,
                imitation_weight: 1.0,
                advantage_factor,
                ..DdpgSettings::default()
            })
        };
        let alike = imitating(0.0);
        let (loss, all_alike) = gradient(&alike, 1, &[true]);
        assert!(loss > 0.0);
        assert_eq!(gradient(&alike, 1, &[false]), (0.0, vec![0.0; all_alike.len()]));
        let (critic, actor) = (&alike.networks.critic.network, &alike.networks.actor.network);
        let (mut pass, mut own) = (Pass::default(), Vec::new());
        act(&mut pass, actor, &INPUT[..3], &mut own);
        let [own, demonstrated] =
            [&own[..], &ACTION[..2]].map(|action| pass.run_joined(critic, &INPUT[..3], action)[0]);
        let advantage = demonstrated - own;
        assert!(advantage != 0.0);
        for factor in [1.0, 3.0, 1_000.0] {
            let expected = (factor * advantage).exp().min(10.0);
            let (weighted, gradient) = gradient(&imitating(factor), 1, &[true]);
            assert!((weighted - expected * loss).abs() < 1e-5 * (1.0 + expected), "{factor}");
            for (weighted, alike) in gradient.iter().zip(&all_alike) {
                assert!((weighted - expected * alike).abs() < 1e-4, "{weighted} {alike}");
            }
        }
    }
}
