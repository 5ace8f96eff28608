//! A batch of sampled transitions, in memory that is used again.

use crate::Scalar;
use crate::config::Dims;
use crate::storage::TransitionId;

/// Sampled transitions, column by column: each column is one contiguous row-major matrix, as
/// networks want it.
///
/// Make it once and pass it to [`Sampler::sample`](crate::Sampler::sample) again and again; its
/// memory is used again. A batch owns its numbers: nothing in it refers to the buffer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Batch<T> {
    pub(crate) observation: Vec<T>,
    pub(crate) achieved_goal: Vec<T>,
    pub(crate) desired_goal: Vec<T>,
    pub(crate) action: Vec<T>,
    pub(crate) reward: Vec<T>,
    pub(crate) next_observation: Vec<T>,
    pub(crate) next_achieved_goal: Vec<T>,
    pub(crate) terminated: Vec<bool>,
    pub(crate) truncated: Vec<bool>,
    pub(crate) transition: Vec<TransitionId>,
    pub(crate) goal_source: Vec<Option<TransitionId>>,
    pub(crate) relabelled: Relabelled,
}

/// The relabelled rows of a batch, side by side for the reward function; empty between calls.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Relabelled {
    pub(crate) rows: Vec<usize>,
    pub(crate) next_achieved_goal: Vec<f64>,
    pub(crate) desired_goal: Vec<f64>,
    pub(crate) reward: Vec<f64>,
}

impl Relabelled {
    pub(crate) fn clear(&mut self) {
        self.rows.clear();
        self.next_achieved_goal.clear();
        self.desired_goal.clear();
        self.reward.clear();
    }
}

impl<T: Scalar> Batch<T> {
    /// An empty batch; the first sample gives it its size.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// The number of rows.
    #[must_use]
    pub fn len(&self) -> usize {
        self.transition.len()
    }

    /// Whether there is no row: nothing has been sampled into it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.transition.is_empty()
    }

    /// The observations, `len * dims.observation`.
    #[must_use]
    pub fn observation(&self) -> &[T] {
        &self.observation
    }

    /// The goals achieved before the step, `len * dims.goal`.
    #[must_use]
    pub fn achieved_goal(&self) -> &[T] {
        &self.achieved_goal
    }

    /// The goals to pursue, `len * dims.goal`: the episode's own, or the new one where
    /// [`goal_source`](Self::goal_source) is set. It goes with the observation and with the next one.
    #[must_use]
    pub fn desired_goal(&self) -> &[T] {
        &self.desired_goal
    }

    /// The actions, `len * dims.action`.
    #[must_use]
    pub fn action(&self) -> &[T] {
        &self.action
    }

    /// The rewards, `len`: as stored, or computed for the new goal where there is one.
    #[must_use]
    pub fn reward(&self) -> &[T] {
        &self.reward
    }

    /// The observations after the step, `len * dims.observation`.
    #[must_use]
    pub fn next_observation(&self) -> &[T] {
        &self.next_observation
    }

    /// The goals achieved after the step, `len * dims.goal`.
    #[must_use]
    pub fn next_achieved_goal(&self) -> &[T] {
        &self.next_achieved_goal
    }

    /// Whether the task was over after the step, `len`. Do not bootstrap there.
    #[must_use]
    pub fn terminated(&self) -> &[bool] {
        &self.terminated
    }

    /// Whether the episode was cut off after the step, `len`. Bootstrap there as anywhere else.
    #[must_use]
    pub fn truncated(&self) -> &[bool] {
        &self.truncated
    }

    /// Which transitions these are, `len`.
    #[must_use]
    pub fn transition(&self) -> &[TransitionId] {
        &self.transition
    }

    /// Where each new goal comes from, `len`: the transition whose next achieved goal it is, or `None`
    /// for a row that was left alone. The difference of the two numbers is how many steps ahead it lies.
    #[must_use]
    pub fn goal_source(&self) -> &[Option<TransitionId>] {
        &self.goal_source
    }

    /// Whether each row got a new goal, `len` of them.
    pub fn relabelled(&self) -> impl ExactSizeIterator<Item = bool> + '_ {
        self.goal_source.iter().map(Option::is_some)
    }

    /// Makes room for `size` rows; what they hold is unspecified.
    pub(crate) fn resize(&mut self, size: usize, dims: Dims) {
        let zero = T::default();
        self.observation.resize(size * dims.observation, zero);
        self.achieved_goal.resize(size * dims.goal, zero);
        self.desired_goal.resize(size * dims.goal, zero);
        self.action.resize(size * dims.action, zero);
        self.reward.resize(size, zero);
        self.next_observation.resize(size * dims.observation, zero);
        self.next_achieved_goal.resize(size * dims.goal, zero);
        self.terminated.resize(size, false);
        self.truncated.resize(size, false);
        self.transition.resize(size, TransitionId::of(0));
        self.goal_source.resize(size, None);
    }
}
