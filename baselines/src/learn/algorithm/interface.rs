//! The interface of learning algorithms.

use std::fmt::Debug;
use std::ops::RangeInclusive;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

use crate::learn::error::TrainError;
use crate::learn::settings::range::check_range;
use crate::trained::LayerWeights;

/// A learning algorithm: it improves an actor with batches of transitions.
///
/// [`Ddpg`](crate::learn::Ddpg), [`Sac`](crate::learn::Sac) and [`Ppo`](crate::learn::Ppo) are the
/// three in this crate. [`Trainer::with_algorithm`](crate::learn::Trainer::with_algorithm) trains with
/// any other.
///
/// An algorithm is deterministic: the same state and the same batch give the same bits, on any
/// number of threads.
///
/// ```
/// use baselines::LayerWeights;
/// use baselines::learn::{Algorithm, Losses, StateMut, Transitions};
///
/// /// Learns the mean action of the buffer, whatever it sees.
/// #[derive(Debug)]
/// struct MeanAction {
///     num_inputs: usize,
///     /// One for each element of an action, before the hyperbolic tangent.
///     biases: Vec<f32>,
///     num_updates: u64,
/// }
///
/// impl Algorithm for MeanAction {
///     fn name(&self) -> &str {
///         "mean-action"
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
///         let mut gradient = vec![0.0; self.biases.len()];
///         for action in batch.action.chunks_exact(self.biases.len()) {
///             for ((slope, bias), action) in gradient.iter_mut().zip(&self.biases).zip(action) {
///                 *slope += (bias.tanh() - action) / batch.len as f32;
///             }
///         }
///         average(&mut gradient);
///         self.biases.iter_mut().zip(&gradient).for_each(|(bias, slope)| *bias -= 0.1 * slope);
///         self.num_updates += 1;
///         Losses::new(0.0, gradient.iter().map(|slope| slope * slope).sum(), 0.0)
///     }
///
///     fn explore(&mut self, _inputs: &[f32], noise: &[f32], actions: &mut [f32]) {
///         let elements = actions.iter_mut().zip(noise).zip(self.biases.iter().cycle());
///         for ((action, noise), bias) in elements {
///             *action = (bias.tanh() + 0.2 * noise).clamp(-1.0, 1.0);
///         }
///     }
///
///     fn greedy_layers(&self) -> Vec<LayerWeights> {
///         let (num_inputs, biases) = (self.num_inputs, self.biases.clone());
///         vec![LayerWeights { num_inputs, weights: vec![0.0; num_inputs * biases.len()], biases }]
///     }
///
///     fn state_mut(&mut self) -> StateMut<'_> {
///         let vectors = vec![("actor.biases".to_owned(), &mut self.biases)];
///         StateMut { num_updates: &mut self.num_updates, vectors }
///     }
/// }
///
/// let mut algorithm = MeanAction { num_inputs: 1, biases: vec![0.0], num_updates: 0 };
/// let batch = Transitions {
///     len: 2,
///     input: &[-1.0, 1.0],
///     actor_input: &[-1.0, 1.0],
///     action: &[0.4, 0.6],
///     reward: &[0.0; 2],
///     discount: &[0.0; 2],
///     next_input: &[0.0; 2],
///     next_actor_input: &[0.0; 2],
///     demonstrated: &[false; 2],
///     ..Transitions::default()
/// };
/// for _ in 0..200 {
///     algorithm.update(batch, &mut |_| ());
/// }
/// let mut action = [0.0];
/// algorithm.explore(&[1.0], &[0.0], &mut action);
/// assert!((action[0] - 0.5).abs() < 1e-3);
/// ```
pub trait Algorithm: Debug + Send {
    /// Returns the name of the algorithm, such as `ddpg`, which policies and checkpoints record.
    fn name(&self) -> &str;

    /// Returns the discount of a step, from 0 to 1. The [`Transitions`] of an update include it.
    fn gamma(&self) -> f64;

    /// Whether it learns only from the steps of its own actions since the last update, as
    /// [`Ppo`](crate::learn::Ppo) does. A trainer then passes all of them, in their order, to one
    /// update in each cycle, and needs the settings of [`TrainSettings::on_policy`]. The default is
    /// false.
    ///
    /// [`TrainSettings::on_policy`]: crate::learn::TrainSettings::on_policy
    fn is_on_policy(&self) -> bool {
        false
    }

    /// Improves the actor by one batch, and returns the losses.
    ///
    /// `average` replaces each number by its mean over all processes that share the run, and does
    /// nothing in a run of one process. Each process has its own batch; all keep the same weights
    /// because they average their gradients before they take a step. Each calls `average` the same
    /// number of times, with slices of the same lengths.
    ///
    /// It runs on a rayon pool of one or two threads.
    fn update(&mut self, batch: Transitions<'_>, average: &mut dyn FnMut(&mut [f32])) -> Losses;

    /// Returns what to show of the last update beside its losses, such as
    /// `("critic_gradient_norm", 0.3)`. A trainer asks after the last update of a cycle; a row of the
    /// curve has the numbers as [`update/critic_gradient_norm`](crate::learn::CurveRow::diagnostics).
    /// The default returns none.
    fn diagnostics(&self) -> Vec<(&'static str, f32)> {
        Vec::new()
    }

    /// Writes exploring actions, from -1 to 1, for `inputs`: one row of each for each environment.
    /// `noise` has a number of the standard normal distribution for each element of the actions.
    fn explore(&mut self, inputs: &[f32], noise: &[f32], actions: &mut [f32]);

    /// Returns the mean value of actions for `inputs`, as the critic estimates it, and replaces the
    /// actions by its derivatives with respect to them: what an actor learns from that sees
    /// something else, as [`Trainer::with_pixels`](crate::learn::Trainer::with_pixels) has it. The
    /// default has no critic of actions, and returns `None`.
    fn value_slopes(&mut self, inputs: &[f32], actions: &mut [f32]) -> Option<f32> {
        let _ = (inputs, actions);
        None
    }

    /// Returns the layers of the greedy actor, the one that is evaluated, with rectified linear
    /// units between them and a hyperbolic tangent of the outputs.
    fn greedy_layers(&self) -> Vec<LayerWeights>;

    /// Lets the actor begin with these layers, which have the shapes of the
    /// [greedy](Self::greedy_layers) ones, in everything that follows it too, and returns true. The
    /// default can not, and returns false.
    fn set_greedy_layers(&mut self, layers: &[LayerWeights]) -> bool {
        let _ = layers;
        false
    }

    /// Returns everything that later updates depend on, to be saved or replaced.
    fn state_mut(&mut self) -> StateMut<'_>;
}

/// A new algorithm, or why it could not be built.
pub(crate) type Built = Result<Box<dyn Algorithm>, TrainError>;

/// What an algorithm is built from: the sizes of its networks, the rewards, and its seed.
#[derive(Clone, Debug, PartialEq)]
pub struct AlgorithmInit {
    /// The length of an input: observation and goal.
    pub num_inputs: usize,
    /// The length of an action.
    pub num_actions: usize,
    /// The range of the rewards, from [`GoalReward::bounds`](goal_reward::GoalReward::bounds); a
    /// trainer rejects rewards outside it.
    pub reward_bounds: RangeInclusive<f64>,
    /// The seed of the initial weights and of all noise, the same in all processes.
    pub seed: u64,
    /// The rank of this process, whose updates need their own noise: 0 in a run of one process.
    pub rank: usize,
}

impl AlgorithmInit {
    /// Returns the random numbers of the first weights, the same in all processes.
    #[must_use]
    pub fn weights_rng(&self) -> ChaCha8Rng {
        ChaCha8Rng::seed_from_u64(self.seed)
    }

    /// Returns the random numbers of noise that this process draws for itself. `number` is from 1 to
    /// 2^48 - 1, such as that of an update; each one has its own.
    #[must_use]
    pub fn noise_rng(&self, number: u64) -> ChaCha8Rng {
        // Stream 0 has drawn the first weights.
        let mut rng = self.weights_rng();
        rng.set_stream((self.rank as u64) << 48 | number);
        rng
    }

    /// Checks the lengths and the bounds.
    pub(super) fn check(&self) -> Result<(), TrainError> {
        check_range!(self.num_inputs, "num_inputs", 1..=16_384)?;
        check_range!(self.num_actions, "num_actions", 1..=1_024)?;
        let (low, high) = (self.reward_bounds.start(), self.reward_bounds.end());
        if low <= high {
            return Ok(());
        }
        Err(TrainError::Setting {
            name: "reward_bounds",
            value: format!("{low} to {high}"),
            expected: "return a range whose start is not above its end from GoalReward::bounds",
        })
    }

    /// Returns the lowest and the highest discounted sum of any number of rewards, at least one.
    pub(super) fn return_bounds(&self, gamma: f64) -> [f32; 2] {
        // One reward, or infinitely many. Without a discount, infinitely many zeros give NaN, which
        // `min` and `max` ignore.
        let endless = |reward: f32| reward / (1.0 - gamma as f32);
        let (low, high) = (*self.reward_bounds.start() as f32, *self.reward_bounds.end() as f32);
        [low.min(endless(low)), high.max(endless(high))]
    }
}

/// The losses of an update, means over its batch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Losses {
    /// The squared error of the critic; of several critics, the sum.
    pub critic: f32,
    /// The loss of the actor.
    pub actor: f32,
    /// The value of the actions in the batch.
    pub value: f32,
}

impl Losses {
    /// Creates losses.
    #[must_use]
    pub const fn new(critic: f32, actor: f32, value: f32) -> Self {
        Self { critic, actor, value }
    }

    /// Whether all are finite numbers.
    pub(crate) fn are_finite(&self) -> bool {
        [self.critic, self.actor, self.value].iter().all(|loss| loss.is_finite())
    }
}

/// A batch of transitions as an algorithm sees it: columns with a row for each transition.
#[derive(Clone, Copy, Debug, Default)]
pub struct Transitions<'a> {
    /// The number of transitions, at least 1.
    pub len: usize,
    /// The inputs of the networks before the step, `(len, num_inputs)`: normalized observations and
    /// goals.
    pub input: &'a [f32],
    /// The same inputs as the actor sees them, `(len, num_inputs)`: with the
    /// [noise](crate::learn::InputSettings::actor_observation_noise) of observations.
    pub actor_input: &'a [f32],
    /// The actions, `(len, num_actions)`, from -1 to 1.
    pub action: &'a [f32],
    /// The rewards, `(len)`.
    pub reward: &'a [f32],
    /// The discounts of the next states' values, `(len)`: 0 where the task ended.
    pub discount: &'a [f32],
    /// The inputs of the networks after the step, `(len, num_inputs)`.
    pub next_input: &'a [f32],
    /// The same inputs as the actor sees them.
    pub next_actor_input: &'a [f32],
    /// Whether each transition comes from a [demonstration](crate::learn::Trainer::add_demonstrations),
    /// `(len)`; empty for an [on-policy](Algorithm::is_on_policy) algorithm. Hindsight may have changed
    /// its goal; its action is the demonstrated one.
    pub demonstrated: &'a [bool],
    /// The noise that [`explore`](Algorithm::explore) made the actions from, `(len, num_actions)`,
    /// for an on-policy algorithm; otherwise empty.
    pub noise: &'a [f32],
    /// Whether each step is the last of its episode, or the last before the update, `(len)`, for an
    /// on-policy algorithm; otherwise empty. The next row is the next step of the same episode where
    /// it is not.
    pub is_last: &'a [bool],
}

impl Transitions<'_> {
    /// Returns the number of elements of an action.
    pub(super) const fn num_actions(&self) -> usize {
        self.action.len() / self.len
    }

    /// Returns the weight of a transition in a mean over the batch.
    pub(super) const fn share(&self) -> f32 {
        1.0 / self.len as f32
    }
}

/// The state of an [`Algorithm`]: everything that its later updates depend on.
#[derive(Debug)]
pub struct StateMut<'a> {
    /// The number of updates so far: it begins with 0, and each update adds 1.
    pub num_updates: &'a mut u64,
    /// Parameters and moments, each under a unique name, which is not `__metadata__`. Names and
    /// lengths never change, and all numbers are finite; a vector whose name ends in
    /// `.second_moment` has none below 0. A trainer saves no checkpoint of another state.
    pub vectors: Vec<(String, &'a mut Vec<f32>)>,
}

impl<'a> StateMut<'a> {
    /// Adds the vectors of the part `name`, such as those of a
    /// [network](crate::network::Network::vectors_mut): `actor.parameters`.
    pub fn push<const N: usize>(&mut self, name: &str, vectors: [(&str, &'a mut Vec<f32>); N]) {
        self.vectors.extend(vectors.map(|(part, vector)| (format!("{name}.{part}"), vector)));
    }
}

#[cfg(test)]
mod tests {
    use super::AlgorithmInit;

    fn return_bounds(low: f64, high: f64, gamma: f64) -> [f32; 2] {
        let reward_bounds = low..=high;
        AlgorithmInit { num_inputs: 1, num_actions: 1, reward_bounds, seed: 0, rank: 0 }
            .return_bounds(gamma)
    }

    /// The extreme returns come from rewards that are all the same.
    #[test]
    fn returns_of_any_number_of_steps_are_within_their_bounds() {
        let rewards = [-3.0, -1.0, 0.0, 0.5, 2.0];
        for (at, low) in rewards.into_iter().enumerate() {
            for high in &rewards[at..] {
                for gamma in [0.0, 0.5, 0.95] {
                    let [least, most] = return_bounds(low, *high, gamma);
                    let (mut sums, mut discount) = ([0.0, 0.0], 1.0);
                    for _ in 0..1_000 {
                        sums[0] += discount * low;
                        sums[1] += discount * high;
                        discount *= gamma;
                        assert!(f64::from(least) <= sums[0] + 1e-4, "{sums:?} {least} {most}");
                        assert!(sums[1] <= f64::from(most) + 1e-4, "{sums:?} {least} {most}");
                    }
                    // No wider than that: the first or the last of the sums.
                    assert!((f64::from(least) - low.min(sums[0])).abs() < 1e-4);
                    assert!((f64::from(most) - high.max(sums[1])).abs() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn rewards_of_the_reference_keep_the_bits_of_its_bounds() {
        for gamma in [0.9, 0.95, 0.98] {
            assert_eq!(return_bounds(-1.0, 0.0, gamma), [-1.0 / (1.0 - gamma as f32), 0.0]);
        }
    }

    #[test]
    fn what_is_endless_has_no_bound() {
        let infinity = f32::INFINITY;
        assert_eq!(return_bounds(-1.0, 0.0, 1.0), [-infinity, 0.0]);
        assert_eq!(return_bounds(0.0, 1.0, 1.0), [0.0, infinity]);
        assert_eq!(return_bounds(f64::NEG_INFINITY, 0.0, 0.9), [-infinity, 0.0]);
        assert_eq!(return_bounds(f64::NEG_INFINITY, f64::INFINITY, 0.9), [-infinity, infinity]);
    }
}
