//! Actions drawn from a normal distribution and passed through a hyperbolic tangent.

use rand::Rng;

use crate::normal::standard_normal;
use crate::tanh::tanh;

/// Half the logarithm of tau, a term of the normal distribution's density.
pub(super) const HALF_LOG_TAU: f32 = 0.918_938_5;

/// Actions drawn from the distribution that an actor describes.
#[derive(Default)]
pub(super) struct Sampled {
    pub(super) actions: Vec<f32>,
    noise: Vec<f32>,
    /// The standard deviations before the hyperbolic tangent.
    stds: Vec<f32>,
    /// Whether the logarithm of the standard deviation is within its bounds.
    is_free: Vec<bool>,
    /// The logarithm of the density of each row's action.
    pub(super) log_densities: Vec<f32>,
}

impl Sampled {
    /// Draws actions, a row for each row of an actor's outputs.
    pub(super) fn draw(&mut self, outputs: &[f32], num_actions: usize, rng: &mut impl Rng) {
        let Self { actions, noise, stds, is_free, log_densities } = self;
        for column in [&mut *actions, noise, stds, log_densities] {
            column.clear();
        }
        is_free.clear();
        for row in outputs.chunks_exact(2 * num_actions) {
            let (means, log_stds) = row.split_at(num_actions);
            let mut log_density = 0.0;
            for (mean, log_std) in means.iter().zip(log_stds) {
                let clamped = clamp_log_std(*log_std);
                let (std, draw) = (libm::expf(clamped), standard_normal(rng));
                let unbounded = mean + std * draw;
                log_density -= 0.5 * draw * draw + clamped + HALF_LOG_TAU + log_slope(unbounded);
                actions.push(tanh(unbounded));
                noise.push(draw);
                stds.push(std);
                is_free.push(clamped == *log_std);
            }
            log_densities.push(log_density);
        }
    }

    /// Returns the gradient of output `index` of the actor, given the gradient of an action's
    /// element and `weight`, the gradient of the logarithms of the densities.
    pub(super) fn slope(
        &self,
        index: usize,
        by_action: impl Fn(usize) -> f32,
        weight: f32,
        num_actions: usize,
    ) -> f32 {
        let (row, column) = (index / (2 * num_actions), index % (2 * num_actions));
        let at = row * num_actions + column % num_actions;
        let action = self.actions[at];
        // The density falls with the slope of the hyperbolic tangent, whose logarithm has the
        // derivative -2 tanh, and with the standard deviation.
        let by_mean = by_action(at) * (1.0 - action * action) + weight * 2.0 * action;
        if column < num_actions {
            by_mean
        } else if self.is_free[at] {
            by_mean * self.stds[at] * self.noise[at] - weight
        } else {
            0.0
        }
    }
}

/// Returns the logarithm of the slope of the hyperbolic tangent, in a form that stays exact far
/// from 0.
fn log_slope(unbounded: f32) -> f32 {
    let size = unbounded.abs();
    2.0 * (std::f32::consts::LN_2 - size - libm::log1pf(libm::expf(-2.0 * size)))
}

/// Clamps the logarithm of a standard deviation to the bounds of Haarnoja et al.
pub(super) fn clamp_log_std(log_std: f32) -> f32 {
    log_std.clamp(-20.0, 2.0)
}
