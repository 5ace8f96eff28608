//! Proximal policy optimization.

use std::ops::Range;

use rand::seq::SliceRandom;

use super::clipped::{Steps, log_density};
use super::critic::{Gradients, debug_settings};
use super::interface::{Algorithm, AlgorithmInit, Losses, StateMut, Transitions};
use super::rollout::Rollout;
use super::sampled::HALF_LOG_TAU;
use crate::learn::error::TrainError;
use crate::learn::settings::algorithm::PpoSettings;
use crate::network::adam::{Adam, Trained};
use crate::network::pass::Pass;
use crate::network::perceptron::{Network, Shape};
use crate::tanh::tanh;
use crate::trained::LayerWeights;
use crate::workers::share_of;

/// Proximal policy optimization: an actor learns from the steps of its own actions, and stays close
/// to the actor that took them; a critic learns the returns.
///
/// Source: Schulman et al., *Proximal policy optimization algorithms*, 2017, as Stable-Baselines3 has
/// it, without clipped values. Hidden layers have rectified linear units, and a hyperbolic tangent
/// bounds the actions, where Stable-Baselines3 clips them.
pub struct Ppo {
    settings: PpoSettings,
    actor: Trained,
    critic: Trained,
    /// The logarithm of the standard deviation of each element of an action, before the hyperbolic
    /// tangent.
    log_stds: Vec<f32>,
    std_adam: Adam,
    /// The number of steps of the optimizers: a vector, as all that is saved.
    num_steps: Vec<f32>,
    /// The gradients of the actor, the deviations and the critic, and means of a batch: the losses of
    /// both, the value, the divergence, and the share of clipped steps.
    gradients: Gradients<4>,
    actor_pass: Pass,
    critic_pass: Pass,
    steps: Steps,
    batch: Steps,
    diagnostics: Diagnostics,
    num_updates: u64,
    init: AlgorithmInit,
}

debug_settings!(Ppo);

/// Means over the batches of an update, or of its last epoch in the case of the divergence.
#[derive(Default)]
struct Diagnostics {
    kl: f32,
    clip_fraction: f32,
    gradient_norm: f32,
}

/// Sums over batches.
#[derive(Default)]
struct Sums {
    count: f32,
    sums: [f32; 5],
}

impl Ppo {
    /// Creates networks with initial weights that `init.seed` determines.
    ///
    /// # Errors
    /// [`TrainError::Setting`] if a setting is out of its range, `init.num_inputs` is not from 1 to
    /// 16,384, `init.num_actions` is not from 1 to 1,024, or `init.reward_bounds` is empty.
    pub fn new(settings: PpoSettings, init: AlgorithmInit) -> Result<Self, TrainError> {
        settings.check()?;
        init.check()?;
        let AlgorithmInit { num_inputs, num_actions, .. } = init;
        let mut rng = init.weights_rng();
        let PpoSettings { hidden, last_layer_scale, learning_rate, initial_std, .. } = &settings;
        let actor = Shape::new(num_inputs, hidden, num_actions, false);
        let actor = Network::init(actor, *last_layer_scale, &mut rng);
        let critic = Network::init(Shape::new(num_inputs, hidden, 1, false), 1.0, &mut rng);
        let lens = [actor.parameters.len(), num_actions, critic.parameters.len(), 5];
        Ok(Self {
            gradients: Gradients::new(lens),
            actor: Trained::new(actor, *learning_rate),
            critic: Trained::new(critic, *learning_rate),
            log_stds: vec![libm::logf(*initial_std); num_actions],
            std_adam: Adam::new(*learning_rate, num_actions),
            num_steps: vec![0.0],
            actor_pass: Pass::default(),
            critic_pass: Pass::default(),
            steps: Steps::default(),
            batch: Steps::default(),
            diagnostics: Diagnostics::default(),
            settings,
            num_updates: 0,
            init,
        })
    }

    /// Finds out what is known of the steps of a rollout before the actor and the critic change.
    fn prepare(&mut self, batch: Transitions<'_>) {
        let Self { settings, actor, critic, log_stds, actor_pass, critic_pass, steps, .. } = self;
        let stds: Vec<f32> = log_stds.iter().map(|log_std| libm::expf(*log_std)).collect();
        let noises = || batch.noise.chunks_exact(stds.len());
        steps.input.clear();
        steps.input.extend_from_slice(batch.input);
        steps.sample.clear();
        let means = actor_pass.run(&actor.network, batch.input).chunks_exact(stds.len());
        for (means, noises) in means.zip(noises()) {
            let row = means.iter().zip(&stds).zip(noises);
            steps.sample.extend(row.map(|((mean, std), noise)| sample(*mean, *std, *noise)));
        }
        steps.log_density.clear();
        steps.log_density.extend(noises().map(|noises| log_density(noises, log_stds)));
        let value = critic_pass.run(&critic.network, batch.input).to_vec();
        let next_value = critic_pass.run(&critic.network, batch.next_input);
        let (reward, discount, is_last) = (batch.reward, batch.discount, batch.is_last);
        // All have a number for each step.
        if let Ok(rollout) = Rollout::new(reward, discount, &value, next_value, is_last) {
            steps.advantage = rollout.advantages(settings.gae_lambda);
            steps.target = rollout.returns(settings.gae_lambda);
        }
    }

    /// Computes the gradients of the loss of some steps, and the means.
    fn compute_gradients(&mut self, rows: &[usize]) {
        if rows.is_empty() {
            // There are more batches than steps.
            self.gradients.numbers.fill(0.0);
            return;
        }
        let Self { settings, actor, critic, log_stds, gradients, .. } = self;
        let Self { actor_pass, critic_pass, steps, batch, .. } = self;
        batch.gather(steps, rows);
        batch.normalize_advantages();
        let [actor_gradient, std_gradient, critic_gradient, means] = gradients.parts_mut();
        let ([actor_loss, kl, clip_fraction], [critic_loss, value]) = rayon::join(
            || {
                let gradients = [actor_gradient, std_gradient];
                batch.actor_gradient(&actor.network, log_stds, settings, actor_pass, gradients)
            },
            || {
                let weight = settings.value_weight;
                batch.critic_gradient(&critic.network, weight, critic_pass, critic_gradient)
            },
        );
        means.copy_from_slice(&[actor_loss, critic_loss, value, kl, clip_fraction]);
    }

    /// Takes a step against the gradients. Returns their norm before they are shortened.
    fn step(&mut self) -> f32 {
        let [actor, stds, critic, _] = self.gradients.parts_mut();
        let all = || actor.iter().chain(&*stds).chain(&*critic);
        let norm = all().map(|slope| f64::from(*slope).powi(2)).sum::<f64>().sqrt() as f32;
        let factor = (self.settings.max_gradient_norm / (norm + 1e-6)).min(1.0);
        for gradient in [&mut *actor, stds, critic] {
            gradient.iter_mut().for_each(|slope| *slope *= factor);
        }
        self.num_steps[0] += 1.0;
        let number = self.num_steps[0] as u64;
        self.actor.step(number, 1.0, actor);
        self.std_adam.step(number, 1.0, &mut self.log_stds, stds);
        self.critic.step(number, 1.0, critic);
        norm
    }
}

impl Algorithm for Ppo {
    fn name(&self) -> &str {
        "ppo"
    }

    fn gamma(&self) -> f64 {
        self.settings.gamma
    }

    fn is_on_policy(&self) -> bool {
        true
    }

    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        let means = self.actor_pass.run(&self.actor.network, inputs);
        let stds = self.log_stds.iter().map(|log_std| libm::expf(*log_std));
        let stds: Vec<f32> = stds.collect();
        let rows = actions.iter_mut().zip(means).zip(noise).zip(stds.iter().cycle());
        for (((action, mean), noise), std) in rows {
            *action = tanh(sample(*mean, *std, *noise));
        }
    }

    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses {
        self.prepare(batch);
        self.num_updates += 1;
        let mut rng = self.init.noise_rng(self.num_updates);
        let mut order: Vec<usize> = (0..batch.len).collect();
        let PpoSettings { epochs, minibatches, target_kl, .. } = self.settings;
        let most_kl = target_kl.map_or(f32::INFINITY, |kl| 1.5 * kl);
        let (mut all, mut of_epoch, mut norms) = (Sums::default(), Sums::default(), 0.0);
        'update: for _ in 0..epochs {
            order.shuffle(&mut rng);
            of_epoch = Sums::default();
            for number in 0..minibatches {
                let rows: Range<usize> = share_of(number, minibatches, batch.len);
                self.compute_gradients(&order[rows]);
                average(&mut self.gradients.numbers);
                let [.., means] = self.gradients.parts_mut();
                all.add(means);
                of_epoch.add(means);
                if means[3] > most_kl {
                    break 'update;
                }
                norms += self.step();
            }
        }
        let [actor_loss, critic_loss, value, _, clip_fraction] = all.means();
        let [.., kl, _] = of_epoch.means();
        let gradient_norm = norms / all.count;
        self.diagnostics = Diagnostics { kl, clip_fraction, gradient_norm };
        Losses::new(critic_loss, actor_loss, value)
    }

    /// Returns the approximate divergence between the actors before and after the update, the share of
    /// clipped steps, the entropy of the actions, and the norm of the gradient before it is shortened.
    fn diagnostics(&self) -> Vec<(&'static str, f32)> {
        let Diagnostics { kl, clip_fraction, gradient_norm } = self.diagnostics;
        let entropy = self.log_stds.iter().map(|log_std| log_std + HALF_LOG_TAU + 0.5).sum();
        vec![
            ("kl", kl),
            ("clip_fraction", clip_fraction),
            ("entropy", entropy),
            ("gradient_norm", gradient_norm),
        ]
    }

    fn greedy_layers(&self) -> Vec<LayerWeights> {
        self.actor.network.layer_weights()
    }

    /// Sets the means of the actions. Their standard deviations begin as in every run.
    fn set_greedy_layers(&mut self, layers: &[LayerWeights]) -> bool {
        self.actor.network.set_layer_weights(layers);
        true
    }

    fn state_mut(&mut self) -> StateMut<'_> {
        let mut state = StateMut { num_updates: &mut self.num_updates, vectors: Vec::new() };
        state.push("actor", self.actor.vectors_mut());
        state.push("critic", self.critic.vectors_mut());
        state.push("deviations", [("logarithms", &mut self.log_stds)]);
        state.push("deviations", self.std_adam.vectors_mut());
        state.push("optimizers", [("steps", &mut self.num_steps)]);
        state
    }
}

impl Sums {
    fn add(&mut self, means: &[f32]) {
        self.count += 1.0;
        self.sums.iter_mut().zip(means).for_each(|(sum, mean)| *sum += mean);
    }

    fn means(&self) -> [f32; 5] {
        self.sums.map(|sum| sum / self.count)
    }
}

/// Returns an element of an action before the hyperbolic tangent.
fn sample(mean: f32, std: f32, noise: f32) -> f32 {
    mean + std * noise
}
