//! Actors: networks that choose actions.

use std::fmt;

use super::network::Network;
use super::pass::Pass;

/// A network that chooses actions in [-1, 1], and how it explores.
#[derive(Clone)]
pub struct Actor {
    network: Network,
    noise: ActionNoise,
    pass: Pass,
}

/// How an [`Actor`] explores.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum ActionNoise {
    /// Noise with this standard deviation is added to the actions, which are then clipped.
    Added(f32),
    /// The network's second half of outputs is the logarithm of the standard deviation before the
    /// hyperbolic tangent.
    Learned,
}

impl fmt::Debug for Actor {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Actor").field("noise", &self.noise).finish_non_exhaustive()
    }
}

impl Actor {
    pub(crate) fn new(network: Network, noise: ActionNoise) -> Self {
        Self { network, noise, pass: Pass::default() }
    }

    /// Writes the actions of normalized inputs, a row for each. `noise` has a number of the standard
    /// normal distribution for each element of the actions.
    ///
    /// # Panics
    /// If the lengths are not those of `num_rows` rows, at least 1, of this actor's environment.
    pub fn act(&mut self, num_rows: usize, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
        self.pass.input_mut(num_rows, inputs.len() / num_rows).copy_from_slice(inputs);
        let outputs = self.pass.forward(&self.network);
        let len = actions.len() / num_rows;
        let rows =
            outputs.chunks_exact(outputs.len() / num_rows).zip(actions.chunks_exact_mut(len));
        for (row, (outputs, actions)) in rows.enumerate() {
            for (index, action) in actions.iter_mut().enumerate() {
                let noise = noise[row * len + index];
                *action = match self.noise {
                    ActionNoise::Added(std) => {
                        noise.mul_add(std, outputs[index].tanh()).clamp(-1.0, 1.0)
                    }
                    ActionNoise::Learned => {
                        (outputs[index] + clamp_log_std(outputs[len + index]).exp() * noise).tanh()
                    }
                };
            }
        }
    }
}

/// Clamps the logarithm of a standard deviation to the bounds of Haarnoja et al.
pub(crate) fn clamp_log_std(log_std: f32) -> f32 {
    log_std.clamp(-20.0, 2.0)
}
