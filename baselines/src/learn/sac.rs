//! Soft actor-critic.

use her_relabel::Batch;
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use serde::{Deserialize, Serialize};

use super::actor::{ActionNoise, Actor, clamp_log_std};
use super::adam::Adam;
use super::algorithm::{Algorithm, Losses, PARTS, Part, StateMut, Trained, in_parts};
use super::network::{Network, Shape};
use super::pass::{Pass, evaluate, run};
use crate::trained::LayerWeights;

/// Settings of [`Sac`].
///
/// The sources are Haarnoja et al., *Soft actor-critic algorithms and applications*, 2018 (the
/// authors below), the Fetch settings of RL Baselines3 Zoo, and this project's own measurements.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SacSettings {
    /// The lengths of the hidden layers of actor and critics: 256, 256, the authors'.
    pub hidden: Vec<usize>,
    /// Whether the critics' hidden layers are normalized: true, as in MRL (Pitis et al., 2020).
    pub layer_norm: bool,
    /// The factor of the actor's last weights at the start: 0.1, as in
    /// [`DdpgSettings`](super::DdpgSettings).
    pub last_layer_scale: f32,
    /// The learning rate of actor, critics and temperature: 0.001, the zoo's. The authors: 0.0003.
    pub learning_rate: f32,
    /// The discount of a step: 0.95, the zoo's. The authors: 0.99.
    pub gamma: f64,
    /// The fraction of the way that target networks move towards the learning ones after every
    /// update: 0.05, the zoo's. The authors: 0.005.
    pub target_fraction: f32,
    /// The temperature at the start, the weight of the entropy: 0.1. Stable-Baselines3: 1.
    pub initial_temperature: f32,
    /// The entropy that the temperature aims at, for each element of an action: -1, the authors'.
    pub target_entropy: f32,
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
#[derive(Debug)]
pub struct Sac {
    settings: SacSettings,
    networks: Networks,
    log_temperature: Vec<f32>,
    temperature_adam: Adam,
    workspaces: [Workspace; PARTS],
    num_updates: u64,
    seed: u64,
}

#[derive(Debug)]
struct Networks {
    actor: Trained,
    critics: [Trained; 2],
    targets: [Network; 2],
}

/// What a part of a batch computes, kept for its memory.
#[derive(Debug, Default)]
struct Workspace {
    actor: Pass,
    critics: [Pass; 2],
    sample: Sampled,
    targets: Vec<f32>,
    /// The gradient of a network's outputs.
    outputs: Vec<f32>,
    critic_gradients: [Vec<f32>; 2],
    actor_gradient: Vec<f32>,
    losses: Losses,
    /// The sum of the logarithms of the actions' densities.
    log_densities: f32,
}

/// Actions drawn from the distribution that an actor describes.
#[derive(Debug, Default)]
struct Sampled {
    actions: Vec<f32>,
    noise: Vec<f32>,
    /// The standard deviations before the hyperbolic tangent.
    stds: Vec<f32>,
    /// Whether the logarithm of the standard deviation is within its bounds.
    is_free: Vec<bool>,
    /// The logarithm of the density of each row's action.
    log_densities: Vec<f32>,
}

impl Sampled {
    /// Draws actions, a row for each row of an actor's outputs.
    fn draw(&mut self, outputs: &[f32], num_actions: usize, rng: &mut impl Rng) {
        let Self { actions, noise, stds, is_free, log_densities } = self;
        for column in [&mut *actions, noise, stds, log_densities] {
            column.clear();
        }
        is_free.clear();
        let half_log_tau = 0.5 * std::f32::consts::TAU.ln();
        for row in outputs.chunks_exact(2 * num_actions) {
            let (means, log_stds) = row.split_at(num_actions);
            let mut log_density = 0.0;
            for (mean, log_std) in means.iter().zip(log_stds) {
                let clamped = clamp_log_std(*log_std);
                let (std, draw) = (clamped.exp(), rng.sample::<f32, _>(StandardNormal));
                let unbounded = mean + std * draw;
                log_density -= 0.5 * draw * draw + clamped + half_log_tau + log_slope(unbounded);
                actions.push(unbounded.tanh());
                noise.push(draw);
                stds.push(std);
                is_free.push(clamped == *log_std);
            }
            log_densities.push(log_density);
        }
    }

    /// Writes the gradient of the actor's outputs, given `slopes`, the gradient of the actions, and
    /// `weight`, that of the logarithms of the densities.
    fn differentiate(&self, slopes: &[f32], weight: f32, num_actions: usize, outputs: &mut [f32]) {
        for (row, outputs) in outputs.chunks_exact_mut(2 * num_actions).enumerate() {
            let (means, log_stds) = outputs.split_at_mut(num_actions);
            for (index, (mean, log_std)) in means.iter_mut().zip(log_stds).enumerate() {
                let at = row * num_actions + index;
                let action = self.actions[at];
                // The density falls with the slope of the hyperbolic tangent, whose logarithm has the
                // derivative -2 tanh, and with the standard deviation.
                *mean = slopes[at] * (1.0 - action * action) + weight * 2.0 * action;
                let by_std = *mean * self.stds[at] * self.noise[at] - weight;
                *log_std = if self.is_free[at] { by_std } else { 0.0 };
            }
        }
    }
}

/// The logarithm of the slope of the hyperbolic tangent, in a form that stays exact far from 0.
fn log_slope(unbounded: f32) -> f32 {
    let size = unbounded.abs();
    2.0 * (std::f32::consts::LN_2 - size - (-2.0 * size).exp().ln_1p())
}

impl Sac {
    /// Makes networks for inputs of `num_inputs` numbers (observation and goal) and actions of
    /// `num_actions`. `seed` decides their first weights and all noise.
    #[must_use]
    pub fn new(settings: SacSettings, num_inputs: usize, num_actions: usize, seed: u64) -> Self {
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
        Self {
            networks,
            log_temperature: vec![settings.initial_temperature.ln()],
            temperature_adam: Adam::new(*learning_rate, 1),
            workspaces: Default::default(),
            settings,
            num_updates: 0,
            seed,
        }
    }
}

impl Workspace {
    /// Computes what the critics should say: the reward and the discounted soft value of the next
    /// state.
    fn compute_targets(
        &mut self,
        part: Part<'_>,
        networks: &Networks,
        temperature: f32,
        rng: &mut impl Rng,
    ) {
        let Part { num_rows, next_inputs, .. } = part;
        let actor = &networks.actor.network;
        let outputs = run(&mut self.actor, actor, num_rows, next_inputs);
        self.sample.draw(outputs, part.actions.len() / num_rows, rng);
        let Self { critics: [first, second], sample, .. } = self;
        let [first_target, second_target] = &networks.targets;
        let first = evaluate(first, first_target, num_rows, next_inputs, &sample.actions);
        let second = evaluate(second, second_target, num_rows, next_inputs, &sample.actions);
        let values = first.iter().zip(second).zip(&sample.log_densities);
        let values = values.map(|((first, second), log)| first.min(*second) - temperature * log);
        let rows = part.rewards.iter().zip(part.discounts).zip(values);
        self.targets.clear();
        self.targets.extend(rows.map(|((reward, discount), value)| reward + discount * value));
    }

    /// Computes the critics' gradients, of the mean squared error.
    fn differentiate_critics(&mut self, part: Part<'_>, critics: &[Trained; 2]) {
        let share = 1.0 / part.batch_len as f32;
        self.losses = Losses::default();
        let passes = self.critics.iter_mut().zip(&mut self.critic_gradients);
        for ((pass, gradient), Trained { network, .. }) in passes.zip(critics) {
            let values = evaluate(pass, network, part.num_rows, part.inputs, part.actions);
            self.losses.value += 0.5 * share * values.iter().sum::<f32>();
            let errors = values.iter().zip(&self.targets).map(|(value, target)| value - target);
            self.losses.critic += errors.clone().map(|error| error * error).sum::<f32>() * share;
            self.outputs.clear();
            self.outputs.extend(errors.map(|error| 2.0 * share * error));
            gradient.resize(network.parameters.len(), 0.0);
            pass.backward(network, &self.outputs, Some(gradient), 0);
        }
    }

    /// Computes the actor's gradient: that of the mean of the temperature times the logarithm of the
    /// density, minus the lower value.
    fn differentiate_actor(
        &mut self,
        part: Part<'_>,
        networks: &Networks,
        temperature: f32,
        rng: &mut impl Rng,
    ) {
        let Part { num_rows, inputs, .. } = part;
        let share = 1.0 / part.batch_len as f32;
        let num_actions = part.actions.len() / num_rows;
        let actor = &networks.actor.network;
        self.sample.draw(run(&mut self.actor, actor, num_rows, inputs), num_actions, rng);
        let Self { critics: [first_pass, second_pass], sample, .. } = self;
        let [first, second] = networks.critics.each_ref().map(|critic| &critic.network);
        let first_values = evaluate(first_pass, first, num_rows, inputs, &sample.actions).to_vec();
        let second_values = evaluate(second_pass, second, num_rows, inputs, &sample.actions);
        let pairs = || first_values.iter().zip(second_values);
        self.log_densities = sample.log_densities.iter().sum();
        let values: f32 = pairs().map(|(first, second)| first.min(*second)).sum();
        self.losses.actor = share * (temperature * self.log_densities - values);
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
        self.actor_gradient.resize(actor.parameters.len(), 0.0);
        self.actor.backward(actor, &self.outputs, Some(&mut self.actor_gradient), 0);
    }
}

impl Algorithm for Sac {
    fn update(&mut self, batch: &Batch<f32>) -> Losses {
        let Self { settings, networks, workspaces, seed, .. } = self;
        let (number, temperature) = (self.num_updates, self.log_temperature[0].exp());
        in_parts(batch, workspaces, |part, work| {
            let mut rng = ChaCha8Rng::seed_from_u64(*seed);
            rng.set_stream(number * PARTS as u64 + part.number as u64);
            work.compute_targets(part, networks, temperature, &mut rng);
            work.differentiate_critics(part, &networks.critics);
            work.differentiate_actor(part, networks, temperature, &mut rng);
        });
        self.num_updates += 1;
        let [first, second] = workspaces;
        for (index, critic) in networks.critics.iter_mut().enumerate() {
            let gradients = [&*first, &*second].map(|part| &*part.critic_gradients[index]);
            critic.step(self.num_updates, gradients);
            networks.targets[index].follow(&critic.network, settings.target_fraction);
        }
        let num_actions = batch.action().len() / batch.len();
        networks.actor.step(self.num_updates, [&first.actor_gradient, &second.actor_gradient]);
        let log_density = (first.log_densities + second.log_densities) / batch.len() as f32;
        let slope = -(log_density + settings.target_entropy * num_actions as f32);
        let gradients: [&[f32]; 2] = [&[slope], &[0.0]];
        self.temperature_adam.step(self.num_updates, &mut self.log_temperature, gradients);
        Losses::sum(first.losses, second.losses)
    }

    fn actor(&self) -> Actor {
        Actor::new(self.networks.actor.network.clone(), ActionNoise::Learned)
    }

    fn greedy_actor(&self) -> Actor {
        self.actor()
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
