//! What a learning algorithm is.

use std::fmt::Debug;

use serde::{Deserialize, Serialize};

use super::error::TrainError;
use super::range::check_range;
use crate::trained::LayerWeights;

/// A learning algorithm: it improves an actor by batches of transitions.
///
/// [`Ddpg`](super::Ddpg) and [`Sac`](super::Sac) are the two that this crate has.
/// [`Trainer::with_algorithm`](super::Trainer::with_algorithm) trains with any other.
///
/// An algorithm is deterministic: the same state and the same batch give the same bits, on any
/// number of threads.
///
/// ```
/// use baselines::LayerWeights;
/// use baselines::learn::{Algorithm, Losses, StateMut, Transitions};
///
/// /// Clones the behavior of the buffer with a linear actor.
/// #[derive(Debug)]
/// struct Cloning {
///     num_inputs: usize,
///     /// A row for each input.
///     weights: Vec<f32>,
///     num_updates: u64,
/// }
///
/// impl Cloning {
///     fn act(&self, inputs: &[f32], actions: &mut [f32]) {
///         let num_actions = self.weights.len() / self.num_inputs;
///         let rows = inputs.chunks_exact(self.num_inputs);
///         for (input, action) in rows.zip(actions.chunks_exact_mut(num_actions)) {
///             action.fill(0.0);
///             for (x, weights) in input.iter().zip(self.weights.chunks_exact(num_actions)) {
///                 action.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += x * weight);
///             }
///             action.iter_mut().for_each(|output| *output = output.tanh());
///         }
///     }
/// }
///
/// impl Algorithm for Cloning {
///     fn name(&self) -> &str {
///         "cloning"
///     }
///
///     fn gamma(&self) -> f64 {
///         1.0
///     }
///
///     fn update(
///         &mut self,
///         batch: Transitions<'_>,
///         average: &mut dyn FnMut(&mut [f32]),
///     ) -> Losses {
///         let mut actions = vec![0.0; batch.action.len()];
///         self.act(batch.input, &mut actions);
///         let num_actions = actions.len() / batch.len;
///         let mut gradient = vec![0.0; self.weights.len()];
///         let mut loss = 0.0;
///         for (row, input) in batch.input.chunks_exact(self.num_inputs).enumerate() {
///             for at in 0..num_actions {
///                 let action = actions[row * num_actions + at];
///                 let error = action - batch.action[row * num_actions + at];
///                 loss += error * error / batch.len as f32;
///                 let slope = 2.0 * error * (1.0 - action * action) / batch.len as f32;
///                 for (x, weights) in input.iter().zip(gradient.chunks_exact_mut(num_actions)) {
///                     weights[at] += slope * x;
///                 }
///             }
///         }
///         average(&mut gradient);
///         for (weight, slope) in self.weights.iter_mut().zip(&gradient) {
///             *weight -= 0.1 * slope;
///         }
///         self.num_updates += 1;
///         Losses::new(0.0, loss, 0.0)
///     }
///
///     fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
///         self.act(inputs, actions);
///         for (action, noise) in actions.iter_mut().zip(noise) {
///             *action = (*action + 0.2 * noise).clamp(-1.0, 1.0);
///         }
///     }
///
///     fn greedy_layers(&self) -> Vec<LayerWeights> {
///         let (num_inputs, weights) = (self.num_inputs, self.weights.clone());
///         let biases = vec![0.0; weights.len() / num_inputs];
///         vec![LayerWeights { num_inputs, weights, biases }]
///     }
///
///     fn state_mut(&mut self) -> StateMut<'_> {
///         let vectors = vec![("actor.weights".to_owned(), &mut self.weights)];
///         StateMut { num_updates: &mut self.num_updates, vectors }
///     }
/// }
///
/// let mut cloning = Cloning { num_inputs: 1, weights: vec![0.0], num_updates: 0 };
/// let batch = Transitions {
///     len: 2,
///     input: &[-1.0, 1.0],
///     action: &[-0.5, 0.5],
///     reward: &[0.0; 2],
///     discount: &[0.0; 2],
///     next_input: &[0.0; 2],
/// };
/// for _ in 0..200 {
///     cloning.update(batch, &mut |_| ());
/// }
/// let mut action = [0.0];
/// cloning.explore(&[1.0], &[0.0], &mut action);
/// assert!((action[0] - 0.5).abs() < 1e-3);
/// ```
pub trait Algorithm: Debug + Send {
    /// The name of the algorithm, such as `ddpg`, which policies and checkpoints record.
    fn name(&self) -> &str;

    /// The discount of a step, from 0 to 1. The [`Transitions`] of an update have it.
    fn gamma(&self) -> f64;

    /// Improves the actor by one batch, and returns the losses.
    ///
    /// `average` replaces each number by its mean over all processes that share the run, and does
    /// nothing in a run of one process. Each process has a batch of its own; they keep the same
    /// weights because each averages its gradients before it takes a step. All of them call
    /// `average` equally often, with as many numbers.
    ///
    /// It runs on a rayon pool of one or two threads.
    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses;

    /// Writes the actions that explore, from -1 to 1, for `inputs`: one row of each for each
    /// environment. `noise` has a number of the standard normal distribution for each element of
    /// the actions.
    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]);

    /// Returns the layers of the greedy actor, which is evaluated: rectified linear units between
    /// them, and a hyperbolic tangent of the outputs.
    fn greedy_layers(&self) -> Vec<LayerWeights>;

    /// Returns everything that the following updates depend on, to be saved or replaced.
    fn state_mut(&mut self) -> StateMut<'_>;
}

/// What an algorithm is built for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AlgorithmInit {
    /// The length of an input: observation and goal.
    pub num_inputs: usize,
    /// The length of an action.
    pub num_actions: usize,
    /// The seed of the first weights and of all noise, the same in all processes.
    pub seed: u64,
    /// The rank of this process, whose updates need noise of their own: 0 in a run of one process.
    pub rank: usize,
}

impl AlgorithmInit {
    /// Checks the lengths.
    pub(super) fn check(self) -> Result<(), TrainError> {
        check_range!(self.num_inputs, "num_inputs", 1..=16_384)?;
        check_range!(self.num_actions, "num_actions", 1..=1_024)
    }
}

/// The losses of an update, means over its batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Losses {
    /// The squared error of the critic, for several critics their sum.
    pub critic: f32,
    /// The loss of the actor.
    pub actor: f32,
    /// The value of the batch's own actions.
    pub value: f32,
}

impl Losses {
    /// Creates losses.
    #[must_use]
    pub const fn new(critic: f32, actor: f32, value: f32) -> Self {
        Self { critic, actor, value }
    }

    /// Returns whether all are finite.
    #[must_use]
    pub fn are_finite(&self) -> bool {
        [self.critic, self.actor, self.value].iter().all(|loss| loss.is_finite())
    }
}

/// A batch of transitions as an algorithm sees it: columns with a row for each transition.
#[derive(Clone, Copy, Debug)]
pub struct Transitions<'a> {
    /// The number of transitions, at least 1.
    pub len: usize,
    /// The inputs of the networks before the step, `(len, num_inputs)`: normalized observations and
    /// goals.
    pub input: &'a [f32],
    /// The actions, `(len, num_actions)`, from -1 to 1.
    pub action: &'a [f32],
    /// The rewards, `(len)`.
    pub reward: &'a [f32],
    /// The discounts of the next states' values, `(len)`: 0 where the task ended.
    pub discount: &'a [f32],
    /// The inputs of the networks after the step, `(len, num_inputs)`.
    pub next_input: &'a [f32],
}

impl Transitions<'_> {
    /// The number of elements of an action.
    pub(crate) const fn num_actions(&self) -> usize {
        self.action.len() / self.len
    }

    /// The weight of a transition in a mean over the batch.
    pub(crate) const fn share(&self) -> f32 {
        1.0 / self.len as f32
    }
}

/// The state of an [`Algorithm`]: everything that its following updates depend on.
#[derive(Debug)]
pub struct StateMut<'a> {
    /// The number of updates so far.
    pub num_updates: &'a mut u64,
    /// Parameters and moments, each with a name of its own. Their lengths never change, and all
    /// numbers are finite; one whose name ends in `.second_moment` has none below 0.
    pub vectors: Vec<(String, &'a mut Vec<f32>)>,
}

impl<'a> StateMut<'a> {
    /// Adds a vector of the part `name`.
    pub(super) fn push(&mut self, name: &str, part: &str, vector: &'a mut Vec<f32>) {
        self.vectors.push((format!("{name}.{part}"), vector));
    }
}
