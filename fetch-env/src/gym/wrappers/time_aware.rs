//! The time in the episode as part of the observation.

use std::num::NonZeroU32;

use super::changed_vector::{ChangedVector, VectorChange};
use super::wrapper::SnapshotWrapper;
use crate::gym::error::EnvError;
use crate::gym::spaces::box_space::{BoxSpace, Element};

/// Observes how much of the episode's time has passed.
///
/// The vector of each observation has one more element at the end: the number of steps taken
/// divided by `max_episode_steps`, from 0 to 1, and 1 in episodes that last longer. This is
/// Gymnasium's wrapper of this name with `normalize_time`.
///
/// ```
/// use fetch_env::{Env, EnvExt, GoalObservation, make_kinematic, wrappers::TimeAwareObservation};
///
/// let env = make_kinematic("FetchReach-v4")?;
/// let steps = env.max_episode_steps();
/// let mut env = env.wrap(TimeAwareObservation::new(steps))?;
/// assert_eq!(env.reset(Some(0))?.observation.observation()[10], 0.0);
/// assert_eq!(env.step(&[0.0; 4])?.observation.observation()[10], 0.02);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type TimeAwareObservation<T = f64> = ChangedVector<Time, T>;

/// The time in an episode.
#[derive(Clone, Copy, Debug)]
pub struct Time {
    max_episode_steps: NonZeroU32,
    elapsed_steps: u32,
}

impl<T> TimeAwareObservation<T> {
    /// Adds the time in episodes that last `max_episode_steps`.
    #[must_use]
    pub fn new(max_episode_steps: NonZeroU32) -> Self {
        Self::from_change(Time { max_episode_steps, elapsed_steps: 0 })
    }
}

impl<T: Element> VectorChange<T> for Time {
    type Changed = T;

    fn attach(&mut self, observed: &BoxSpace<T>) -> Result<BoxSpace<T>, EnvError> {
        self.elapsed_steps = 0;
        let bounds =
            |bounds: &[T], time| bounds.iter().copied().chain([T::from_f64(time)]).collect();
        let (low, high) = (bounds(observed.low(), 0.0), bounds(observed.high(), 1.0));
        Ok(BoxSpace::new(vec![observed.len() + 1], low, high)?)
    }

    fn change(&mut self, observed: &[T], is_first: bool, changed: &mut [T]) {
        self.elapsed_steps = if is_first { 0 } else { self.elapsed_steps.saturating_add(1) };
        let share = f64::from(self.elapsed_steps) / f64::from(self.max_episode_steps.get());
        if let Some((time, kept)) = changed.split_last_mut() {
            kept.copy_from_slice(observed);
            *time = T::from_f64(share.min(1.0));
        }
    }
}

impl SnapshotWrapper for Time {
    type State = u32;

    fn state(&self) -> u32 {
        self.elapsed_steps
    }

    fn check_state(&self, _state: &u32) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, state: &u32) {
        self.elapsed_steps = *state;
    }
}
