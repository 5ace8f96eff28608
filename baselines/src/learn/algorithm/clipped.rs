//! The objective of proximal policy optimization and the critic's error, with their gradients.

use super::sampled::HALF_LOG_TAU;
use crate::learn::settings::algorithm::PpoSettings;
use crate::network::pass::Pass;
use crate::network::perceptron::Network;

/// What an update knows of its steps, a row for each.
#[derive(Default)]
pub(super) struct Steps {
    pub(super) input: Vec<f32>,
    /// The actions before the hyperbolic tangent.
    pub(super) sample: Vec<f32>,
    /// The logarithm of their density when they were taken.
    pub(super) log_density: Vec<f32>,
    pub(super) advantage: Vec<f32>,
    /// The return.
    pub(super) target: Vec<f32>,
}

impl Steps {
    /// Replaces these steps by rows of others.
    pub(super) fn gather(&mut self, others: &Self, rows: &[usize]) {
        let len = others.target.len();
        for (column, other) in [
            (&mut self.input, &others.input),
            (&mut self.sample, &others.sample),
            (&mut self.log_density, &others.log_density),
            (&mut self.advantage, &others.advantage),
            (&mut self.target, &others.target),
        ] {
            let width = other.len() / len;
            column.clear();
            for row in rows {
                column.extend_from_slice(&other[row * width..][..width]);
            }
        }
    }

    /// Gives the advantages a mean of 0 and a standard deviation of 1.
    pub(super) fn normalize_advantages(&mut self) {
        let len = self.advantage.len() as f32;
        if len < 2.0 {
            return;
        }
        let mean = self.advantage.iter().sum::<f32>() / len;
        let squares = self.advantage.iter().map(|advantage| (advantage - mean).powi(2));
        let std = (squares.sum::<f32>() / (len - 1.0)).sqrt() + 1e-8;
        self.advantage.iter_mut().for_each(|advantage| *advantage = (*advantage - mean) / std);
    }

    /// Returns the weight of a step in a mean.
    fn share(&self) -> f32 {
        1.0 / self.target.len() as f32
    }

    /// Computes the gradients of the clipped objective, and of the entropy, with respect to the
    /// actor and the logarithms of the deviations. Returns the objective's loss, the divergence from
    /// the actor that took the steps, and the share of steps beyond the clip range.
    pub(super) fn actor_gradient(
        &self,
        actor: &Network,
        log_stds: &[f32],
        settings: &PpoSettings,
        pass: &mut Pass,
        [gradient, std_gradient]: [&mut [f32]; 2],
    ) -> [f32; 3] {
        let PpoSettings { clip_range, entropy_weight, .. } = *settings;
        let num_actions = log_stds.len();
        let inverse_stds: Vec<f32> = log_stds.iter().map(|log_std| libm::expf(-log_std)).collect();
        let means = pass.run(actor, &self.input).iter().zip(inverse_stds.iter().cycle());
        let samples = self.sample.iter().zip(means);
        let noise: Vec<f32> =
            samples.map(|(sample, (mean, inverse))| (sample - mean) * inverse).collect();
        std_gradient.fill(-entropy_weight);
        // The slope of the loss with respect to the logarithm of each density.
        let mut slopes = Vec::with_capacity(self.target.len());
        let [mut loss, mut kl, mut clipped] = [0.0; 3];
        let rows = noise.chunks_exact(num_actions).zip(&self.log_density).zip(&self.advantage);
        for ((noise, before), advantage) in rows {
            let log_ratio = log_density(noise, log_stds) - before;
            let ratio = libm::expf(log_ratio);
            let bounded = ratio.clamp(1.0 - clip_range, 1.0 + clip_range);
            loss -= (advantage * ratio).min(advantage * bounded) * self.share();
            kl += (ratio - 1.0 - log_ratio) * self.share();
            clipped += f32::from((ratio - 1.0).abs() > clip_range) * self.share();
            let is_free = advantage * ratio <= advantage * bounded;
            let slope = if is_free { -advantage * ratio * self.share() } else { 0.0 };
            slopes.push(slope);
            for (gradient, noise) in std_gradient.iter_mut().zip(noise) {
                *gradient += slope * (noise * noise - 1.0);
            }
        }
        let by_mean = |index: usize, _| {
            slopes[index / num_actions] * noise[index] * inverse_stds[index % num_actions]
        };
        pass.backward(actor, by_mean, Some(gradient), 0);
        [loss, kl, clipped]
    }

    /// Computes the gradient of the critic's mean squared error, times `weight`. Returns the error
    /// and the mean value.
    pub(super) fn critic_gradient(
        &self,
        critic: &Network,
        weight: f32,
        pass: &mut Pass,
        gradient: &mut [f32],
    ) -> [f32; 2] {
        let values = pass.run(critic, &self.input);
        let value = values.iter().sum::<f32>() * self.share();
        let errors = values.iter().zip(&self.target).map(|(value, target)| value - target);
        let loss = errors.map(|error| error * error).sum::<f32>() * self.share();
        let slope =
            |row: usize, value: f32| 2.0 * weight * self.share() * (value - self.target[row]);
        pass.backward(critic, slope, Some(gradient), 0);
        [loss, value]
    }
}

/// Returns the logarithm of the density of an action, before the hyperbolic tangent, whose slope
/// cancels in ratios.
pub(super) fn log_density(noise: &[f32], log_stds: &[f32]) -> f32 {
    let elements = noise.iter().zip(log_stds);
    elements.map(|(noise, log_std)| -0.5 * noise * noise - log_std - HALF_LOG_TAU).sum()
}
