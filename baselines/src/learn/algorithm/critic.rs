//! What actor-critic algorithms share: what critics learn from, gradients that processes average, and
//! how an algorithm is printed.

use super::interface::Transitions;
use crate::network::pass::Pass;
use crate::network::perceptron::Network;
use crate::network::vectors::parts_mut;

impl Transitions<'_> {
    /// Returns what a critic learns, `(len)`: the reward plus the discounted value of the next state.
    pub fn targets(&self, next_values: impl IntoIterator<Item = f32>) -> impl Iterator<Item = f32> {
        let rows = self.reward.iter().zip(self.discount).zip(next_values);
        rows.map(|((reward, discount), value)| reward + discount * value)
    }

    /// Writes the gradient of a critic's mean squared error against `targets`, which has a number for
    /// each parameter. The critic takes an input joined with an action. Returns the error and the mean
    /// value.
    pub fn regress(
        &self,
        pass: &mut Pass,
        critic: &Network,
        targets: &[f32],
        gradient: &mut [f32],
    ) -> [f32; 2] {
        let share = self.share();
        let values = pass.run_joined(critic, self.input, self.action);
        let value = values.iter().sum::<f32>() * share;
        let errors = values.iter().zip(targets).map(|(value, target)| value - target);
        let loss = errors.map(|error| error * error).sum::<f32>() * share;
        let slope = |row: usize, value: f32| 2.0 * share * (value - targets[row]);
        pass.backward(critic, slope, Some(gradient), 0);
        [loss, value]
    }
}

/// The gradients of an update and then the losses, in one vector that processes average.
pub(super) struct Gradients<const N: usize> {
    pub(super) numbers: Vec<f32>,
    lens: [usize; N],
}

impl<const N: usize> Gradients<N> {
    /// Creates parts with these lengths.
    pub(super) fn new(lens: [usize; N]) -> Self {
        Self { numbers: vec![0.0; lens.iter().sum()], lens }
    }

    /// Returns the parts.
    pub(super) fn parts_mut(&mut self) -> [&mut [f32]; N] {
        parts_mut(&mut self.numbers, self.lens)
    }

    /// Returns the Euclidean norm of each part, and the last part.
    pub(super) fn norms(&self) -> ([f32; N], &[f32]) {
        let (mut rest, mut part) = (self.numbers.as_slice(), self.numbers.as_slice());
        let norms = self.lens.map(|len| {
            (part, rest) = rest.split_at(len);
            part.iter().map(|slope| slope * slope).sum::<f32>().sqrt()
        });
        (norms, part)
    }
}

/// Lets an algorithm print its settings and how often it was updated, but not its weights.
macro_rules! debug_settings {
    ($algorithm:ident) => {
        impl std::fmt::Debug for $algorithm {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.debug_struct(stringify!($algorithm))
                    .field("settings", &self.settings)
                    .field("num_updates", &self.num_updates)
                    .finish_non_exhaustive()
            }
        }
    };
}
pub(super) use debug_settings;
