//! Soft actor-critic.

use std::fmt;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::actor::{ActionNoise, Actor};
use super::adam::Adam;
use super::algorithm::{Algorithm, Losses, StateMut, Trained, Transitions, check_lengths};
use super::error::TrainError;
use super::network::{Network, Shape};
use super::pass::{Pass, evaluate, run};
use super::range::settings;
use super::sampled::Sampled;
use crate::trained::LayerWeights;
use crate::workers::Workers;

settings! {
    /// Settings of [`Sac`].
    ///
    /// The sources are Haarnoja et al., *Soft actor-critic algorithms and applications*, 2018 (the
    /// authors below), the Fetch settings of RL Baselines3 Zoo, and this project's own
    /// measurements.
    pub struct SacSettings {
        /// The lengths of the hidden layers of actor and critics: 256, 256, the authors'.
        pub hidden: Vec<usize> => 1..=1_024 in at most 4 layers,
        /// Whether the critics' hidden layers are normalized: true, as in MRL (Pitis et al., 2020).
        pub layer_norm: bool,
        /// The factor of the actor's last weights at the start: 0.1, as in
        /// [`DdpgSettings`](super::DdpgSettings).
        pub last_layer_scale: f32 => 0.0..=10.0,
        /// The learning rate of actor, critics and temperature: 0.001, the zoo's. The authors:
        /// 0.0003.
        pub learning_rate: f32 => 1e-9..=1.0,
        /// The discount of a step: 0.95, the zoo's. The authors: 0.99.
        pub gamma: f64 => 0.0..=1.0,
        /// The fraction of the way that target networks move towards the learning ones after every
        /// update: 0.05, the zoo's. The authors: 0.005.
        pub target_fraction: f32 => 1e-6..=1.0,
        /// The temperature at the start, the weight of the entropy: 0.1. Stable-Baselines3: 1.
        pub initial_temperature: f32 => 1e-6..=1_000.0,
        /// The entropy that the temperature aims at, for each element of an action: -1, the
        /// authors'.
        pub target_entropy: f32 => -100.0..=0.69,
    }
}

impl Default for SacSettings {
    fn default() -> Self {
        Self {
            hidden: vec![256, 256],
            layer_norm: true,
            last_layer_scale: 0.1,
            learning_rate: 0.001,
            gamma: 0.95,
            target_fraction: 0.05,
            initial_temperature: 0.1,
            target_entropy: -1.0,
        }
    }
}

/// Soft actor-critic: two critics learn the value of actions plus the entropy of the policy, and an
/// actor learns a distribution of actions. The temperature adapts itself.
///
/// Source: Haarnoja et al., 2018, as in [`SacSettings`].
pub struct Sac {
    settings: SacSettings,
    networks: Networks,
    log_temperature: Vec<f32>,
    temperature_adam: Adam,
    critic_work: CriticWork,
    actor_work: ActorWork,
    /// The gradients of both critics and of the actor, and the losses behind them.
    gradients: Vec<f32>,
    num_updates: u64,
    seed: u64,
}

/// The losses that processes average: the critics', the actor's, the value, and the logarithm of the
/// actions' density.
const NUM_LOSSES: usize = 4;

struct Networks {
    actor: Trained,
    critics: [Trained; 2],
    targets: [Network; 2],
}

/// What the critics' gradients need, kept for their memory.
#[derive(Default)]
struct CriticWork {
    actor: Pass,
    critics: [Pass; 2],
    next: Sampled,
    targets: Vec<f32>,
    /// The gradient of a critic's outputs.
    outputs: Vec<f32>,
    loss: f32,
    value: f32,
}

/// What the actor's gradient needs, kept for its memory.
#[derive(Default)]
struct ActorWork {
    actor: Pass,
    critics: [Pass; 2],
    sample: Sampled,
    /// The gradient of the actor's outputs.
    outputs: Vec<f32>,
    loss: f32,
    /// The mean of the logarithms of the actions' densities.
    log_density: f32,
}

impl fmt::Debug for Sac {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sac")
            .field("settings", &self.settings)
            .field("num_updates", &self.num_updates)
            .finish_non_exhaustive()
    }
}

impl Sac {
    /// Makes networks for inputs of `num_inputs` numbers (observation and goal) and actions of
    /// `num_actions`. `seed` decides their first weights and all noise.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `num_inputs` is not from 1 to 16,384,
    /// or `num_actions` is not from 1 to 1,024.
    pub fn new(
        settings: SacSettings,
        num_inputs: usize,
        num_actions: usize,
        seed: u64,
    ) -> Result<Self, TrainError> {
        settings.check()?;
        check_lengths(num_inputs, num_actions)?;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let SacSettings { hidden, layer_norm, last_layer_scale, learning_rate, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, 2 * num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Shape::new(num_inputs + num_actions, hidden, 1, *layer_norm);
        let targets = [(); 2].map(|()| Network::init(critic.clone(), 1.0, &mut rng));
        let networks = Networks {
            actor: Trained::new(actor, *learning_rate),
            critics: targets.clone().map(|critic| Trained::new(critic, *learning_rate)),
            targets,
        };
        let [first, second] = &networks.critics;
        let parts = [first, second, &networks.actor];
        let len: usize = parts.iter().map(|part| part.network.parameters.len()).sum();
        Ok(Self {
            networks,
            gradients: vec![0.0; len + NUM_LOSSES],
            log_temperature: vec![settings.initial_temperature.ln()],
            temperature_adam: Adam::new(*learning_rate, 1),
            critic_work: CriticWork::default(),
            actor_work: ActorWork::default(),
            settings,
            num_updates: 0,
            seed,
        })
    }
}

impl CriticWork {
    /// Computes what the critics should say: the reward and the discounted soft value of the next
    /// state.
    fn compute_targets(
        &mut self,
        batch: Transitions<'_>,
        networks: &Networks,
        temperature: f32,
        rng: &mut impl Rng,
    ) {
        let (len, inputs) = (batch.len, batch.next_inputs);
        let outputs = run(&mut self.actor, &networks.actor.network, len, inputs);
        self.next.draw(outputs, batch.num_actions(), rng);
        let Self { critics: [first, second], next, .. } = self;
        let [first_target, second_target] = &networks.targets;
        let first = evaluate(first, first_target, len, inputs, &next.actions);
        let second = evaluate(second, second_target, len, inputs, &next.actions);
        let values = first.iter().zip(second).zip(&next.log_densities);
        let values = values.map(|((first, second), log)| first.min(*second) - temperature * log);
        let rows = batch.rewards.iter().zip(batch.discounts).zip(values);
        self.targets.clear();
        self.targets.extend(rows.map(|((reward, discount), value)| reward + discount * value));
    }

    /// Computes the critics' gradients, of the mean squared error.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        critics: &[Trained; 2],
        gradients: &mut [f32],
    ) {
        let share = batch.share();
        (self.loss, self.value) = (0.0, 0.0);
        let passes = self.critics.iter_mut().zip(gradients.chunks_exact_mut(gradients.len() / 2));
        for ((pass, gradient), Trained { network, .. }) in passes.zip(critics) {
            let values = evaluate(pass, network, batch.len, batch.inputs, batch.actions);
            self.value += 0.5 * share * values.iter().sum::<f32>();
            let errors = values.iter().zip(&self.targets).map(|(value, target)| value - target);
            self.loss += errors.clone().map(|error| error * error).sum::<f32>() * share;
            self.outputs.clear();
            self.outputs.extend(errors.map(|error| 2.0 * share * error));
            pass.backward(network, &self.outputs, Some(gradient), 0);
        }
    }
}

impl ActorWork {
    /// Computes the actor's gradient: that of the mean of the temperature times the logarithm of the
    /// density, minus the lower value.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        networks: &Networks,
        temperature: f32,
        rng: &mut impl Rng,
        gradient: &mut [f32],
    ) {
        let Transitions { len, inputs, .. } = batch;
        let (share, num_actions) = (batch.share(), batch.num_actions());
        let actor = &networks.actor.network;
        self.sample.draw(run(&mut self.actor, actor, len, inputs), num_actions, rng);
        let Self { critics: [first_pass, second_pass], sample, .. } = self;
        let [first, second] = networks.critics.each_ref().map(|critic| &critic.network);
        let first_values = evaluate(first_pass, first, len, inputs, &sample.actions).to_vec();
        let second_values = evaluate(second_pass, second, len, inputs, &sample.actions);
        let pairs = || first_values.iter().zip(second_values);
        self.log_density = sample.log_densities.iter().sum::<f32>() * share;
        let values: f32 = pairs().map(|(first, second)| first.min(*second)).sum();
        self.loss = temperature * self.log_density - share * values;
        let lower = |is_first: bool| {
            let slope = move |(first, second): (&f32, &f32)| {
                if (first <= second) == is_first { -share } else { 0.0 }
            };
            pairs().map(slope).collect::<Vec<f32>>()
        };
        let (first_outputs, second_outputs) = (lower(true), lower(false));
        let mut slopes = first_pass.backward(first, &first_outputs, None, num_actions).to_vec();
        let second_slopes = second_pass.backward(second, &second_outputs, None, num_actions);
        slopes.iter_mut().zip(second_slopes).for_each(|(sum, slope)| *sum += slope);
        self.outputs.resize(2 * slopes.len(), 0.0);
        sample.differentiate(&slopes, temperature * share, num_actions, &mut self.outputs);
        self.actor.backward(actor, &self.outputs, Some(gradient), 0);
    }
}

impl Algorithm for Sac {
    fn update(&mut self, batch: Transitions<'_>, workers: &mut dyn Workers) -> Losses {
        let Self { settings, networks, critic_work, actor_work, gradients, seed, .. } = self;
        let num_updates = &mut self.num_updates;
        let critics_len = 2 * networks.critics[0].network.parameters.len();
        let actor_len = networks.actor.network.parameters.len();
        let (critic_gradients, rest) = gradients.split_at_mut(critics_len);
        let (actor_gradient, losses) = rest.split_at_mut(actor_len);
        let temperature = self.log_temperature[0].exp();
        *num_updates += 1;
        // Stream 0 has drawn the first weights.
        let first_stream = ((workers.rank() as u64) << 48) | (2 * *num_updates);
        let noise = |branch: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(*seed);
            rng.set_stream(first_stream + branch);
            rng
        };
        rayon::join(
            || {
                critic_work.compute_targets(batch, networks, temperature, &mut noise(0));
                critic_work.differentiate(batch, &networks.critics, critic_gradients);
            },
            || {
                let rng = &mut noise(1);
                actor_work.differentiate(batch, networks, temperature, rng, actor_gradient);
            },
        );
        let ActorWork { loss, log_density, .. } = *actor_work;
        losses.copy_from_slice(&[critic_work.loss, loss, critic_work.value, log_density]);
        workers.average(gradients);
        let (critic_gradients, rest) = gradients.split_at(critics_len);
        let (actor_gradient, losses) = rest.split_at(actor_len);
        let Networks { actor, critics, targets } = networks;
        rayon::join(
            || {
                let gradients = critic_gradients.chunks_exact(critics_len / 2);
                for ((critic, target), gradient) in critics.iter_mut().zip(targets).zip(gradients) {
                    critic.step(*num_updates, gradient);
                    target.follow(&critic.network, settings.target_fraction);
                }
            },
            || actor.step(*num_updates, actor_gradient),
        );
        let target = settings.target_entropy * batch.num_actions() as f32;
        let slope = -(losses[3] + target);
        self.temperature_adam.step(*num_updates, &mut self.log_temperature, &[slope]);
        Losses { critic: losses[0], actor: losses[1], value: losses[2] }
    }

    fn actor(&self) -> Actor {
        Actor::new(self.networks.actor.network.clone(), ActionNoise::Learned)
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        let mut layers = self.networks.actor.network.layer_weights();
        if let Some(LayerWeights { weights, biases, .. }) = layers.last_mut() {
            let num_actions = biases.len() / 2;
            let means = weights.chunks_exact(biases.len()).flat_map(|row| &row[..num_actions]);
            *weights = means.copied().collect();
            biases.truncate(num_actions);
        }
        layers
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let Networks { actor, critics: [first, second], targets } = &mut self.networks;
        let [first_target, second_target] = targets;
        let mut state = StateMut::new(&mut self.num_updates);
        state.push_trained("actor", actor);
        state.push_trained("critic_1", first);
        state.push_trained("critic_2", second);
        state.push_target("target_1", first_target);
        state.push_target("target_2", second_target);
        state.push("temperature", "logarithm", &mut self.log_temperature);
        state.push_adam("temperature", &mut self.temperature_adam);
        state
    }
}
