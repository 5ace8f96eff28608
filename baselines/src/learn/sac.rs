//! Soft actor-critic.

use std::fmt;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::adam::{Adam, Trained};
use super::algorithm::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use super::critic::{evaluate, regress};
use super::error::TrainError;
use super::network::{Network, Shape};
use super::pass::{Pass, run};
use super::range::settings;
use super::sampled::{Sampled, clamp_log_std};
use crate::trained::LayerWeights;

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
    exploring: Pass,
    /// The gradients of both critics and of the actor, and the losses behind them: the critics',
    /// the actor's, the value, and the logarithm of the actions' density.
    gradients: Vec<f32>,
    num_updates: u64,
    seed: u64,
    rank: usize,
}

struct Networks {
    actor: Trained,
    critics: [Trained; 2],
    targets: [Network; 2],
}

impl Sac {
    /// Creates networks, whose first weights and noise `init.seed` decides.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, or `init.num_actions` is not from 1 to 1,024.
    pub fn new(settings: SacSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let AlgorithmInit { num_inputs, num_actions, seed, rank } = init;
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
        let num_losses = 4;
        Ok(Self {
            networks,
            gradients: vec![0.0; len + num_losses],
            log_temperature: vec![settings.initial_temperature.ln()],
            temperature_adam: Adam::new(*learning_rate, 1),
            critic_work: CriticWork::default(),
            actor_work: ActorWork::default(),
            exploring: Pass::default(),
            settings,
            num_updates: 0,
            seed,
            rank,
        })
    }
}

impl Algorithm for Sac {
    fn name(&self) -> &str {
        "sac"
    }

    fn gamma(&self) -> f64 {
        self.settings.gamma
    }

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        let Self { settings, networks, critic_work, actor_work, gradients, seed, .. } = self;
        let num_updates = &mut self.num_updates;

        // The gradients of this process.
        let critics_len = 2 * networks.critics[0].network.parameters.len();
        let actor_len = networks.actor.network.parameters.len();
        let (critic_gradients, rest) = gradients.split_at_mut(critics_len);
        let (actor_gradient, losses) = rest.split_at_mut(actor_len);
        let temperature = self.log_temperature[0].exp();
        *num_updates += 1;
        // Stream 0 has drawn the first weights.
        let first_stream = ((self.rank as u64) << 48) | (2 * *num_updates);
        let noise = |branch: u64| {
            let mut rng = ChaCha8Rng::seed_from_u64(*seed);
            rng.set_stream(first_stream + branch);
            rng
        };
        let ((critic_loss, value), (actor_loss, log_density)) = rayon::join(
            || {
                critic_work.compute_targets(batch, networks, temperature, &mut noise(0));
                critic_work.differentiate(batch, &networks.critics, critic_gradients)
            },
            || {
                let rng = &mut noise(1);
                actor_work.differentiate(batch, networks, temperature, rng, actor_gradient)
            },
        );
        losses.copy_from_slice(&[critic_loss, actor_loss, value, log_density]);

        // The same step in all processes.
        average(gradients);
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
        Losses::new(losses[0], losses[1], losses[2])
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let actor = &self.networks.actor.network;
        let num_actions = actions.len() / (inputs.len() / actor.shape.num_inputs());
        let outputs = run(&mut self.exploring, actor, inputs).chunks_exact(2 * num_actions);
        let rows = actions.chunks_exact_mut(num_actions).zip(noise.chunks_exact(num_actions));
        for ((actions, noise), outputs) in rows.zip(outputs) {
            let (means, log_stds) = outputs.split_at(num_actions);
            for (((action, noise), mean), log_std) in
                actions.iter_mut().zip(noise).zip(means).zip(log_stds)
            {
                *action = (mean + clamp_log_std(*log_std).exp() * noise).tanh();
            }
        }
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
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        actor.push_to("actor", &mut state);
        first.push_to("critic_1", &mut state);
        second.push_to("critic_2", &mut state);
        first_target.push_to("target_1", &mut state);
        second_target.push_to("target_2", &mut state);
        state.push("temperature", "logarithm", &mut self.log_temperature);
        self.temperature_adam.push_to("temperature", &mut state);
        state
    }
}

/// What the critics' gradients need, kept for their memory.
#[derive(Default)]
struct CriticWork {
    actor: Pass,
    critics: [Pass; 2],
    next: Sampled,
    targets: Vec<f32>,
    slopes: Vec<f32>,
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
        let inputs = batch.next_input;
        let outputs = run(&mut self.actor, &networks.actor.network, inputs);
        self.next.draw(outputs, batch.num_actions(), rng);
        let Self { critics: [first, second], next, .. } = self;
        let [first_target, second_target] = &networks.targets;
        let first = evaluate(first, first_target, inputs, &next.actions);
        let second = evaluate(second, second_target, inputs, &next.actions);
        let values = first.iter().zip(second).zip(&next.log_densities);
        let values = values.map(|((first, second), log)| first.min(*second) - temperature * log);
        let rows = batch.reward.iter().zip(batch.discount).zip(values);
        self.targets.clear();
        self.targets.extend(rows.map(|((reward, discount), value)| reward + discount * value));
    }

    /// Computes the critics' gradients, and returns the sum of their losses and the mean value.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        critics: &[Trained; 2],
        gradients: &mut [f32],
    ) -> (f32, f32) {
        let (mut loss, mut value) = (0.0, 0.0);
        let Self { critics: passes, targets, slopes, .. } = self;
        let halves = gradients.chunks_exact_mut(gradients.len() / 2);
        for ((pass, gradient), Trained { network, .. }) in
            passes.iter_mut().zip(halves).zip(critics)
        {
            let own = regress(pass, network, batch, targets, slopes, gradient);
            loss += own.0;
            value += 0.5 * own.1;
        }
        (loss, value)
    }
}

/// What the actor's gradient needs, kept for its memory.
#[derive(Default)]
struct ActorWork {
    actor: Pass,
    critics: [Pass; 2],
    sample: Sampled,
    /// The gradient of the actor's outputs.
    slopes: Vec<f32>,
}

impl ActorWork {
    /// Computes the gradient of the actor's loss, the mean of the temperature times the logarithm
    /// of the density, minus the lower value. Returns the loss and the mean of the logarithms.
    fn differentiate(
        &mut self,
        batch: Transitions<'_>,
        networks: &Networks,
        temperature: f32,
        rng: &mut impl Rng,
        gradient: &mut [f32],
    ) -> (f32, f32) {
        let inputs = batch.input;
        let (share, num_actions) = (batch.share(), batch.num_actions());
        let actor = &networks.actor.network;
        self.sample.draw(run(&mut self.actor, actor, inputs), num_actions, rng);
        let Self { critics: [first_pass, second_pass], sample, .. } = self;
        let [first, second] = networks.critics.each_ref().map(|critic| &critic.network);
        let first_values = evaluate(first_pass, first, inputs, &sample.actions).to_vec();
        let second_values = evaluate(second_pass, second, inputs, &sample.actions);
        let pairs = || first_values.iter().zip(second_values);
        let log_density = sample.log_densities.iter().sum::<f32>() * share;
        let values: f32 = pairs().map(|(first, second)| first.min(*second)).sum();
        let loss = temperature * log_density - share * values;
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
        self.slopes.resize(2 * slopes.len(), 0.0);
        sample.differentiate(&slopes, temperature * share, num_actions, &mut self.slopes);
        self.actor.backward(actor, &self.slopes, Some(gradient), 0);
        (loss, log_density)
    }
}

impl fmt::Debug for Sac {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sac")
            .field("settings", &self.settings)
            .field("num_updates", &self.num_updates)
            .finish_non_exhaustive()
    }
}
