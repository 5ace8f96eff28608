//! The results of many environments, row after row.

use std::mem;

use crate::gym::env::goal::Info;
use crate::gym::env::observation::{ArrayRows, BatchObservation, GoalObservation, Rows};
use crate::gym::env::{ActionElement, Env};
use crate::gym::spaces::{Space, element::ArrayElement};
use crate::gym::{error::EnvError, vec_env::error::VecEnvError};

/// The results of a number of environments, row after row, each part contiguous.
///
/// After [`step`](super::VecEnv::step) and [`reset`](super::VecEnv::reset) row `i` is environment
/// `i`. After [`recv`](super::VecEnv::recv) the rows are in the order in which the environments
/// finished, and [`env_index`](Self::env_index) identifies them. A reset gives reward 0 and ends no
/// episode.
///
/// `O` is the observation of an environment, `I` its info and `A` an element of its actions.
#[derive(Clone, Debug)]
pub struct VecStep<O: BatchObservation, I = Info, A = f32> {
    /// The vector: a number that no other has.
    source: u64,
    len: usize,
    env_index: Vec<usize>,
    /// The number of steps, starts and failures of each environment.
    number: Vec<u64>,
    action_len: usize,
    action: Vec<A>,
    pub(super) observation: O::Rows,
    /// `None` if it always equals `observation`.
    next_observation: Option<O::Rows>,
    pub(super) reward: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    stepped: Vec<bool>,
    started: Vec<bool>,
    pub(super) info: Vec<Option<I>>,
    final_info: Vec<Option<I>>,
    error: Vec<Option<EnvError>>,
}

/// The results of environments of the type `E`.
pub type VecStepOf<E> = VecStep<<E as Env>::Observation, <E as Env>::Info, ActionElement<E>>;

/// Defines getters of columns, which have one element per row.
macro_rules! columns {
    ($($(#[$doc:meta])* $column:ident: [$type:ty],)*) => {$(
        $(#[$doc])*
        #[must_use]
        pub fn $column(&self) -> &[$type] {
            &self.$column[..self.len]
        }
    )*};
}

impl<O: BatchObservation, I, A> VecStep<O, I, A> {
    /// Returns the number of rows.
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
        /// Returns the environment of each row.
        env_index: [usize],
        /// Returns the rewards; NaN where the step failed.
        reward: [f64],
        /// Returns how many steps, starts and failures each environment has had in this vector,
        /// restored states included. A row without any has the number of the row before it.
        number: [u64],
        /// Whether each task has ended.
        terminated: [bool],
        /// Whether each episode was cut off, by a time limit or by a failure of its environment.
        truncated: [bool],
        /// Whether each environment took a step in this call: false if it was reset instead, if the
        /// step failed, or if the call left it out.
        stepped: [bool],
        /// Whether each observation is the first of an episode that this call began.
        started: [bool],
        /// Returns the info of each row; in rows with a [`final_info`](Self::final_info) it is the
        /// next episode's, as in Gymnasium. `None` where the step failed, unless the environment
        /// was reset in the same step.
        info: [Option<I>],
        /// Returns the info of the last step of each episode that ended in its row, if
        /// [`AutoresetMode::SameStep`](super::AutoresetMode::SameStep) has already begun the next
        /// one.
        final_info: [Option<I>],
    }

    /// Returns the info of the row's own step or reset, even if the next episode has begun in the
    /// same step; `None` where the step failed.
    #[must_use]
    pub fn step_info(&self, row: usize) -> Option<&I> {
        let has_failed = self.error(row).is_some() && !self.stepped[row];
        let info = self.final_info().get(row)?.as_ref().or(self.info[row].as_ref());
        info.filter(|_| !has_failed)
    }

    /// Returns the actions taken: `len` rows. Those of rows that did not step mean nothing.
    #[must_use]
    pub fn action(&self) -> &[A] {
        &self.action[..self.len * self.action_len]
    }

    /// Returns the observations, for types of rows that have no getters here; the first `len` rows
    /// count.
    #[must_use]
    pub const fn observation_rows(&self) -> &O::Rows {
        &self.observation
    }

    /// Returns the observations to which the actions led; the first `len` rows count.
    ///
    /// They are the [observations](Self::observation_rows), except where
    /// [`AutoresetMode::SameStep`](super::AutoresetMode::SameStep) has already begun the next
    /// episode: there they are the last of the old one.
    #[must_use]
    pub fn next_observation_rows(&self) -> &O::Rows {
        self.next_observation.as_ref().unwrap_or(&self.observation)
    }

    /// Returns a number that no other vector of environments has, in no process.
    #[must_use]
    pub const fn source(&self) -> u64 {
        self.source
    }

    /// Returns the error of this row. Its observation is then the environment's last one (NaN
    /// before the first, and after a failed one was [restored](super::VecEnv::restore)), unless the
    /// environment was reset in the same step.
    ///
    /// An invalid action or reset option changes nothing. A failure ends the episode: `truncated`
    /// is true, and the environment is reset as its [`AutoresetMode`](super::AutoresetMode) says;
    /// one that [panicked](EnvError::Panicked) is out of use.
    #[must_use]
    pub fn error(&self, row: usize) -> Option<&EnvError> {
        self.error[..self.len].get(row)?.as_ref()
    }

    /// Iterates over the rows with an error.
    pub fn errors(&self) -> impl Iterator<Item = (usize, &EnvError)> {
        let rows = self.error[..self.len].iter().enumerate();
        rows.filter_map(|(row, error)| Some((row, error.as_ref()?)))
    }
}

impl<O: BatchObservation, I: AsRef<Info>, A> VecStep<O, I, A> {
    /// Iterates over the successes of the steps: whether the goal that each row's action achieved
    /// counts as the desired one. For a row that was reset instead, the goal is that of its first
    /// observation; false where the step failed.
    pub fn success(&self) -> impl ExactSizeIterator<Item = bool> {
        (0..self.len).map(|row| self.step_info(row).is_some_and(|info| info.as_ref().is_success))
    }

    /// Iterates over the distances between the goal that each row's action achieved and the desired
    /// one. For a row that was reset instead, the goal is that of its first observation; NaN where
    /// the step failed.
    pub fn distance(&self) -> impl ExactSizeIterator<Item = f64> {
        (0..self.len).map(|row| self.step_info(row).map_or(f64::NAN, |info| info.as_ref().distance))
    }
}

/// The parts of goal-conditioned observations.
impl<O: GoalObservation, I, A> VecStep<O, I, A> {
    /// Returns the observations: `len` rows.
    #[must_use]
    pub fn observation(&self) -> &[O::Element] {
        self.observation.as_ref().observation(self.len)
    }

    /// Returns the achieved goals: `len` rows.
    #[must_use]
    pub fn achieved_goal(&self) -> &[f64] {
        self.observation.as_ref().achieved_goal(self.len)
    }

    /// Returns the desired goals: `len` rows.
    #[must_use]
    pub fn desired_goal(&self) -> &[f64] {
        self.observation.as_ref().desired_goal(self.len)
    }

    /// Returns the observations to which the actions led, the last of each episode included: `len`
    /// rows, as a replay buffer needs them.
    #[must_use]
    pub fn next_observation(&self) -> &[O::Element] {
        self.next_observation_rows().as_ref().observation(self.len)
    }

    /// Returns the goals that the actions achieved: `len` rows.
    #[must_use]
    pub fn next_achieved_goal(&self) -> &[f64] {
        self.next_observation_rows().as_ref().achieved_goal(self.len)
    }

    /// Returns the goals for which the actions were taken: `len` rows.
    #[must_use]
    pub fn next_desired_goal(&self) -> &[f64] {
        self.next_observation_rows().as_ref().desired_goal(self.len)
    }
}

/// Observations that are arrays.
impl<T, O, I, A> VecStep<O, I, A>
where
    T: ArrayElement,
    O: AsRef<[T]> + BatchObservation<Rows = ArrayRows<T>>,
{
    /// Returns the observations: `len` rows.
    #[must_use]
    pub fn array(&self) -> &[T] {
        self.observation.array(self.len)
    }

    /// Returns the observations to which the actions led, the last of each episode included: `len`
    /// rows.
    #[must_use]
    pub fn next_array(&self) -> &[T] {
        self.next_observation_rows().array(self.len)
    }
}

/// Collecting the rows of environments.
impl<O: BatchObservation, I: Clone, A: Copy + Default> VecStep<O, I, A> {
    /// Creates `capacity` rows without results.
    pub(super) fn new(
        space: &Space,
        action_len: usize,
        keeps_last: bool,
        capacity: usize,
    ) -> Result<Self, VecEnvError> {
        let rows = || O::Rows::new(space, capacity);
        Ok(Self {
            source: 0,
            len: capacity,
            env_index: (0..capacity).collect(),
            number: vec![0; capacity],
            action_len,
            action: vec![A::default(); capacity * action_len],
            observation: rows()?,
            next_observation: keeps_last.then(rows).transpose()?,
            reward: vec![f64::NAN; capacity],
            terminated: vec![false; capacity],
            truncated: vec![false; capacity],
            stepped: vec![false; capacity],
            started: vec![false; capacity],
            info: vec![None; capacity],
            final_info: vec![None; capacity],
            error: vec![None; capacity],
        })
    }

    /// Sets the vector to which the rows belong.
    pub(super) fn with_source(self, source: u64) -> Self {
        Self { source, ..self }
    }

    pub(super) const fn clear(&mut self) {
        self.len = 0;
    }

    /// Appends the single row of an environment's results.
    pub(super) fn push(&mut self, env_index: usize, from: &Self) {
        let row = self.len;
        self.len += 1;
        self.env_index[row] = env_index;
        self.number[row] = from.number[0];
        self.action[row * self.action_len..][..self.action_len].copy_from_slice(&from.action);
        self.observation.copy_row(row, &from.observation, 0);
        if let (Some(next), Some(from)) = (&mut self.next_observation, &from.next_observation) {
            next.copy_row(row, from, 0);
        }
        self.reward[row] = from.reward[0];
        self.terminated[row] = from.terminated[0];
        self.truncated[row] = from.truncated[0];
        self.stepped[row] = from.stepped[0];
        self.started[row] = from.started[0];
        self.info[row].clone_from(&from.info[0]);
        self.final_info[row].clone_from(&from.final_info[0]);
        self.error[row].clone_from(&from.error[0]);
    }
}

/// Writing the single row of an environment's results.
impl<O: BatchObservation, I, A: Copy> VecStep<O, I, A> {
    /// Clears the last step, but not its observation.
    pub(super) fn begin(&mut self) {
        self.set_outcome(0.0, false, false);
        self.stepped[0] = false;
        self.started[0] = false;
        self.info[0] = None;
        self.final_info[0] = None;
        self.error[0] = None;
    }

    pub(super) fn set_action(&mut self, action: &[A]) {
        self.action.copy_from_slice(action);
    }

    /// Writes the first observation of an episode, or that of a restored state, which has no info.
    pub(super) fn set_start(&mut self, observation: &O, info: Option<I>) -> Result<(), EnvError> {
        self.observation.write_row(0, observation)?;
        if !self.stepped[0]
            && let Some(next) = &mut self.next_observation
        {
            next.write_row(0, observation)?;
        }
        self.started[0] = true;
        self.final_info[0] = mem::replace(&mut self.info[0], info);
        Ok(())
    }

    /// Writes the observation to which the action led.
    pub(super) fn set_step(&mut self, observation: &O, info: I) -> Result<(), EnvError> {
        self.observation.write_row(0, observation)?;
        if let Some(next) = &mut self.next_observation {
            next.write_row(0, observation)?;
        }
        self.stepped[0] = true;
        self.info[0] = Some(info);
        Ok(())
    }

    pub(super) fn set_outcome(&mut self, reward: f64, terminated: bool, truncated: bool) {
        self.reward[0] = reward;
        self.terminated[0] = terminated;
        self.truncated[0] = truncated;
    }

    /// Writes an error. If only the reset after a step failed, the step stays.
    pub(super) fn set_error(&mut self, error: EnvError, ends_episode: bool) {
        if !self.stepped[0] {
            self.set_outcome(f64::NAN, false, ends_episode);
        }
        self.error[0] = Some(error);
    }

    /// Counts the row if it has a step, a start or a failure.
    pub(super) fn count(&mut self) {
        self.number[0] += u64::from(self.stepped[0] || self.started[0] || self.truncated[0]);
    }

    /// Counts the state with which a restored one replaced that of `before`.
    pub(super) fn count_after(&mut self, before: &Self) {
        self.number[0] = before.number[0] + 1;
    }

    /// Notes that the row has been collected, so that a later call does not report its step, or the
    /// end of its episode, again.
    pub(super) fn collected(&mut self) {
        for flag in
            [&mut self.stepped, &mut self.started, &mut self.terminated, &mut self.truncated]
        {
            flag[0] = false;
        }
    }
}
