//! Deep deterministic policy gradient.

use std::fmt;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::adam::Trained;
use super::algorithm::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use super::critic::{evaluate, regress};
use super::error::TrainError;
use super::network::{Network, Shape};
use super::pass::{Pass, run};
use super::range::settings;
use crate::trained::LayerWeights;

settings! {
    /// Settings of [`Ddpg`].
    ///
    /// The sources are the authors of Fetch (Plappert et al., *Multi-goal reinforcement learning*,
    /// 2018, and `her/experiment/config.py` of openai/baselines) and this project's own
    /// measurements. The defaults are those of the preset `fast`.
    pub struct DdpgSettings {
        /// The lengths of the hidden layers of actor and critic: 256, 256. The authors: 256, 256,
        /// 256.
        pub hidden: Vec<usize> => 1..=1_024 in at most 4 layers,
        /// Whether the critic's hidden layers are normalized: false, the authors'; measured, Push
        /// learns later with it, and updates take a quarter longer. MRL (Pitis et al., 2020): true.
        pub layer_norm: bool,
        /// The factor of the actor's last weights at the start: 0.1, measured, because an actor
        /// that starts saturated never starts. The authors: 1.
        pub last_layer_scale: f32 => 0.0..=10.0,
        /// The learning rate of the actor: 0.002, measured. The authors, and for Reach and Slide:
        /// 0.001.
        pub actor_learning_rate: f32 => 1e-9..=1.0,
        /// The learning rate of the critic: 0.002, measured. The authors, and for Reach and Slide:
        /// 0.001.
        pub critic_learning_rate: f32 => 1e-9..=1.0,
        /// The discount of a step: 0.95, measured. The authors, and for Slide: 0.98, which is 1 - 1
        /// / 50 steps.
        pub gamma: f64 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones: 0.05, the
        /// authors'.
        pub target_fraction: f32 => 1e-6..=1.0,
        /// The number of updates between two such moves: 1, measured. The authors: 40.
        pub target_interval: u64 => 1..=1_000_000,
        /// The fraction of the way that the actor that is evaluated moves towards the learning one
        /// after every update: 0.005, measured, because single updates make single states better
        /// and others worse; 1 for Reach, and 0.0003 for Slide, where success rates vary by 0.1
        /// with 0.005. The authors: 1, which is the learning actor.
        pub average_fraction: f32 => 1e-6..=1.0,
        /// The weight of the mean square of the actions in the actor's loss: 0.05, measured, 0.5
        /// for Reach, and 0.01 for Slide, as in MRL (Pitis et al., 2020). The authors: 1.
        pub action_l2: f32 => 0.0..=1_000.0,
        /// Whether targets are clipped to `[-1 / (1 - gamma), 0]`, the values that rewards of -1
        /// and 0 can have: true, the authors'. Other rewards need false.
        pub clip_targets: bool,
        /// The standard deviation of the noise that explores: 0.2, the authors'; 0.1 for Slide, as
        /// in MRL.
        pub noise: f32 => 0.0..=10.0,
    }
}

impl Default for DdpgSettings {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            layer_norm: false,
            last_layer_scale: 0.1,
            actor_learning_rate: 0.002,
            critic_learning_rate: 0.002,
            gamma: 0.95,
            target_fraction: 0.05,
            target_interval: 1,
            average_fraction: 0.005,
            action_l2: 0.05,
            clip_targets: true,
            noise: 0.2,
        }
    }
}

impl DdpgSettings {
    /// The authors' settings.
    #[must_use]
    pub fn authors() -> Self {
        Self {
            hidden: vec![256; 3],
            last_layer_scale: 1.0,
            actor_learning_rate: 0.001,
            critic_learning_rate: 0.001,
            gamma: 0.98,
            target_interval: 40,
            average_fraction: 1.0,
            action_l2: 1.0,
            ..Self::default()
        }
    }
}

/// Deep deterministic policy gradient: a critic learns the value of actions, and an actor learns
/// actions of the highest value.
///
/// Source: Lillicrap et al., *Continuous control with deep reinforcement learning*, 2016. As in
/// openai/baselines, actor and critic take their steps at the same time.
pub struct Ddpg {
    settings: DdpgSettings,
    networks: Networks,
    critic_work: CriticWork,
    actor_work: ActorWork,
    exploring: Pass,
    /// The gradients of critic and actor, and the losses behind them: the critic's, the actor's and
    /// the value.
    gradients: Vec<f32>,
    num_updates: u64,
}

struct Networks {
    actor: Trained,
    critic: Trained,
    target_actor: Network,
    target_critic: Network,
    averaged_actor: Network,
}

impl Ddpg {
    /// Creates networks, whose first weights `init.seed` decides.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, or `init.num_actions` is not from 1 to 1,024.
    pub fn new(settings: DdpgSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let AlgorithmInit { num_inputs, num_actions, seed, .. } = init;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let DdpgSettings { hidden, layer_norm, last_layer_scale, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Shape::new(num_inputs + num_actions, hidden, 1, *layer_norm);
        let critic = Network::init(critic, 1.0, &mut rng);
        let num_losses = 3;
        Ok(Self {
            gradients: vec![0.0; critic.parameters.len() + actor.parameters.len() + num_losses],
            networks: Networks {
                averaged_actor: actor.clone(),
                target_actor: actor.clone(),
                target_critic: critic.clone(),
                actor: Trained::new(actor, settings.actor_learning_rate),
                critic: Trained::new(critic, settings.critic_learning_rate),
            },
            critic_work: CriticWork::default(),
            actor_work: ActorWork::default(),
            exploring: Pass::default(),
            num_updates: 0,
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

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        let Self { settings, networks, critic_work, actor_work, gradients, num_updates, .. } = self;
        let (actor, critic) = (&networks.actor.network, &networks.critic.network);
        let lens = [critic, actor].map(|network| network.parameters.len());

        // The gradients of this process.
        let (critic_gradient, rest) = gradients.split_at_mut(lens[0]);
        let (actor_gradient, losses) = rest.split_at_mut(lens[1]);
        let ((critic_loss, value), actor_loss) = rayon::join(
            || {
                critic_work.compute_targets(batch, networks, settings);
                critic_work.differentiate(batch, critic, critic_gradient)
            },
            || actor_work.differentiate(batch, actor, critic, settings.action_l2, actor_gradient),
        );
        losses.copy_from_slice(&[critic_loss, actor_loss, value]);

        // The same step in all processes.
        average(gradients);
        let (critic_gradient, rest) = gradients.split_at(lens[0]);
        let (actor_gradient, losses) = rest.split_at(lens[1]);
        *num_updates += 1;
        let follows = num_updates.is_multiple_of(settings.target_interval);
        let step = |trained: &mut Trained, target: &mut Network, gradient: &[f32]| {
            trained.step(*num_updates, gradient);
            if follows {
                target.follow(&trained.network, settings.target_fraction);
            }
        };
        let Networks { actor, critic, target_actor, target_critic, averaged_actor } = networks;
        rayon::join(
            || step(critic, target_critic, critic_gradient),
            || {
                step(actor, target_actor, actor_gradient);
                averaged_actor.follow(&actor.network, settings.average_fraction);
            },
        );
        Losses::new(losses[0], losses[1], losses[2])
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let outputs = run(&mut self.exploring, &self.networks.actor.network, inputs);
        for ((action, output), noise) in actions.iter_mut().zip(outputs).zip(noise) {
            *action = noise.mul_add(self.settings.noise, output.tanh()).clamp(-1.0, 1.0);
        }
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.networks.averaged_actor.layer_weights()
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let Networks { actor, critic, target_actor, target_critic, averaged_actor } =
            &mut self.networks;
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        actor.push_to("actor", &mut state);
        critic.push_to("critic", &mut state);
        target_actor.push_to("target_actor", &mut state);
        target_critic.push_to("target_critic", &mut state);
        averaged_actor.push_to("averaged_actor", &mut state);
        state
    }
}

/// What the critic's gradient needs, kept for its memory.
#[derive(Default)]
struct CriticWork {
    actor: Pass,
    critic: Pass,
    next_actions: Vec<f32>,
    targets: Vec<f32>,
    slopes: Vec<f32>,
}

impl CriticWork {
    /// Computes what the critic should say: the reward and the discounted value of the next state.
    fn compute_targets(
        &mut self,
        batch: Transitions<'_>,
        networks: &Networks,
        settings: &DdpgSettings,
    ) {
        let Networks { target_actor, target_critic, .. } = networks;
        let outputs = run(&mut self.actor, target_actor, batch.next_input);
        self.next_actions.clear();
        self.next_actions.extend(outputs.iter().map(|output| output.tanh()));
        let values =
            evaluate(&mut self.critic, target_critic, batch.next_input, &self.next_actions);
        let lowest = -1.0 / (1.0 - settings.gamma as f32);
        let targets = batch.reward.iter().zip(batch.discount).zip(values);
        let targets = targets.map(|((reward, discount), value)| reward + discount * value);
        self.targets.clear();
        if settings.clip_targets {
            self.targets.extend(targets.map(|target| target.clamp(lowest, 0.0)));
        } else {
            self.targets.extend(targets);
        }
    }

    /// Computes the critic's gradient, and returns its loss and the mean value.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        critic: &Network,
        gradient: &mut [f32],
    ) -> (f32, f32) {
        let Self { critic: pass, targets, slopes, .. } = self;
        regress(pass, critic, batch, targets, slopes, gradient)
    }
}

/// What the actor's gradient needs, kept for its memory.
#[derive(Default)]
struct ActorWork {
    actor: Pass,
    critic: Pass,
    actions: Vec<f32>,
    /// The gradient of a network's outputs.
    slopes: Vec<f32>,
}

impl ActorWork {
    /// Computes the gradient of the actor's loss, and returns the loss: the negative mean value,
    /// and the mean squared action times `action_l2`.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        actor: &Network,
        critic: &Network,
        action_l2: f32,
        gradient: &mut [f32],
    ) -> f32 {
        let outputs = run(&mut self.actor, actor, batch.input);
        self.actions.clear();
        self.actions.extend(outputs.iter().map(|output| output.tanh()));
        let values = evaluate(&mut self.critic, critic, batch.input, &self.actions);
        let weight = action_l2 * batch.share() / batch.num_actions() as f32;
        let squares = self.actions.iter().map(|action| action * action).sum::<f32>();
        let loss = weight * squares - values.iter().sum::<f32>() * batch.share();
        self.slopes.clear();
        self.slopes.resize(batch.len, -batch.share());
        let by_action = self.critic.backward(critic, &self.slopes, None, batch.num_actions());
        self.slopes.clear();
        self.slopes.extend(
            by_action
                .iter()
                .zip(&self.actions)
                .map(|(slope, action)| (slope + 2.0 * weight * action) * (1.0 - action * action)),
        );
        self.actor.backward(actor, &self.slopes, Some(gradient), 0);
        loss
    }
}

impl fmt::Debug for Ddpg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Ddpg")
            .field("settings", &self.settings)
            .field("num_updates", &self.num_updates)
            .finish_non_exhaustive()
    }
}
