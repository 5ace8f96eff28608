//! The results of many environments, row after row.

use std::{array, ops::Range};

use crate::env::goal::{GoalObservation, Info};
use crate::error::EnvError;

/// The results of a number of environments, row after row, each part contiguous.
///
/// After [`step`](super::VecEnv::step) and [`reset`](super::VecEnv::reset) row `i` is environment
/// `i`. After [`recv`](super::VecEnv::recv) the rows are in the order in which the environments
/// finished, and [`env_ids`](Self::env_ids) identifies them. A reset gives reward 0 and ends
/// nothing.
#[derive(Clone, Debug)]
pub struct Batch {
    len: usize,
    env_ids: Vec<usize>,
    state: GoalRows,
    reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    success: Vec<bool>,
    distance: Vec<f64>,
    final_state: GoalRows,
    final_info: Vec<Option<Info>>,
    error: Vec<Option<EnvError>>,
}

/// Observations, achieved and desired goals, in this order, each row-major.
#[derive(Clone, Debug)]
struct GoalRows {
    lens: [usize; 3],
    parts: [Vec<f64>; 3],
}

/// The last step of an episode whose environment was reset in the same step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct FinalStep<'a> {
    /// The last observation.
    pub observation: &'a [f64],
    /// The goal achieved at the end.
    pub achieved_goal: &'a [f64],
    /// The goal of the episode.
    pub desired_goal: &'a [f64],
    /// The info of the last step.
    pub info: Info,
}

/// Defines getters of what each row has one element of.
macro_rules! columns {
    ($($(#[$doc:meta])* $column:ident: [$type:ty],)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $column(&self) -> &[$type] {
            &self.$column[..self.len]
        }
    )*};
}

impl Batch {
    /// Creates `capacity` rows without results yet: numbers are NaN. `lens` are the lengths of an
    /// observation, an achieved and a desired goal.
    pub(super) fn new(lens: [usize; 3], capacity: usize) -> Self {
        Self {
            len: capacity,
            env_ids: (0..capacity).collect(),
            state: GoalRows::new(lens, capacity),
            reward: vec![f64::NAN; capacity],
            terminated: vec![false; capacity],
            truncated: vec![false; capacity],
            success: vec![false; capacity],
            distance: vec![f64::NAN; capacity],
            final_state: GoalRows::new(lens, capacity),
            final_info: vec![None; capacity],
            error: vec![None; capacity],
        }
    }

    /// The number of rows.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether there are no rows.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    columns! {
        /// The environment of each row.
        env_ids: [usize],
        /// The rewards; NaN in rows with an [`error`](Self::error).
        reward: [f64],
        /// Whether each task has ended.
        terminated: [bool],
        /// Whether each episode was cut off, by a time limit or by a failure of its environment.
        truncated: [bool],
        /// [`Info::is_success`] of each row; in rows with a [`final_step`](Self::final_step) the
        /// next episode's, as in Gymnasium.
        success: [bool],
        /// [`Info::distance`] of each row.
        distance: [f64],
    }

    /// The observations: `len` rows.
    #[must_use]
    pub fn observation(&self) -> &[f64] {
        self.state.rows(0..self.len)[0]
    }

    /// The achieved goals: `len` rows.
    #[must_use]
    pub fn achieved_goal(&self) -> &[f64] {
        self.state.rows(0..self.len)[1]
    }

    /// The desired goals: `len` rows.
    #[must_use]
    pub fn desired_goal(&self) -> &[f64] {
        self.state.rows(0..self.len)[2]
    }

    /// Returns the last step of the episode that ended in this row, if
    /// [`AutoresetMode::SameStep`](super::AutoresetMode::SameStep) has already begun the next one.
    #[must_use]
    pub fn final_step(&self, row: usize) -> Option<FinalStep<'_>> {
        let info = self.final_info[..self.len].get(row).copied().flatten()?;
        let [observation, achieved_goal, desired_goal] = self.final_state.rows(row..row + 1);
        Some(FinalStep { observation, achieved_goal, desired_goal, info })
    }

    /// Returns the error of this row. Its observation is then the environment's last one (NaN
    /// before the first), unless the environment was reset in the same step.
    ///
    /// An invalid action changes nothing. A failure ends the episode: `truncated` is true, and the
    /// environment is reset as its [`AutoresetMode`](super::AutoresetMode) says; one that
    /// [panicked](EnvError::Panicked) is out of use.
    #[must_use]
    pub fn error(&self, row: usize) -> Option<&EnvError> {
        self.error[..self.len].get(row)?.as_ref()
    }

    /// Iterates over the rows with an error.
    pub fn errors(&self) -> impl Iterator<Item = (usize, &EnvError)> {
        let rows = self.error[..self.len].iter().enumerate();
        rows.filter_map(|(row, error)| Some((row, error.as_ref()?)))
    }

    pub(super) const fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends the row of an environment's own batch.
    pub(super) fn push(&mut self, env_id: usize, from: &Self) {
        let row = self.len;
        self.len += 1;
        self.env_ids[row] = env_id;
        self.state.write(row, from.state.rows(0..1));
        self.reward[row] = from.reward[0];
        self.terminated[row] = from.terminated[0];
        self.truncated[row] = from.truncated[0];
        self.success[row] = from.success[0];
        self.distance[row] = from.distance[0];
        self.final_info[row] = from.final_info[0];
        if self.final_info[row].is_some() {
            self.final_state.write(row, from.final_state.rows(0..1));
        }
        self.error[row].clone_from(&from.error[0]);
    }
}

/// Writing the single row of an environment's own batch.
impl Batch {
    /// Clears the last step, but not its observation.
    pub(super) fn begin(&mut self) {
        self.set_outcome(0.0, false, false);
        self.final_info[0] = None;
        self.error[0] = None;
    }

    pub(super) fn set_state(&mut self, observation: &impl GoalObservation, info: Info) {
        self.state.set(observation);
        self.success[0] = info.is_success;
        self.distance[0] = info.distance;
    }

    pub(super) fn set_outcome(&mut self, reward: f64, terminated: bool, truncated: bool) {
        self.reward[0] = reward;
        self.terminated[0] = terminated;
        self.truncated[0] = truncated;
    }

    pub(super) fn set_final(&mut self, observation: &impl GoalObservation, info: Info) {
        self.final_state.set(observation);
        self.final_info[0] = Some(info);
    }

    pub(super) fn set_error(&mut self, error: EnvError, ends_episode: bool) {
        self.set_outcome(f64::NAN, false, ends_episode);
        self.success[0] = false;
        self.distance[0] = f64::NAN;
        self.error[0] = Some(error);
    }
}

impl GoalRows {
    fn new(lens: [usize; 3], rows: usize) -> Self {
        Self { lens, parts: lens.map(|len| vec![f64::NAN; rows * len]) }
    }

    fn rows(&self, rows: Range<usize>) -> [&[f64]; 3] {
        array::from_fn(|i| &self.parts[i][rows.start * self.lens[i]..rows.end * self.lens[i]])
    }

    fn set(&mut self, from: &impl GoalObservation) {
        self.write(0, [from.observation(), from.achieved_goal(), from.desired_goal()]);
    }

    fn write(&mut self, row: usize, values: [&[f64]; 3]) {
        for ((part, len), values) in self.parts.iter_mut().zip(self.lens).zip(values) {
            part[row * len..][..len].copy_from_slice(values);
        }
    }
}
