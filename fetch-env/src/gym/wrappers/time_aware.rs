//! The time in the episode as part of the observation.

use std::num::NonZeroU32;

use super::macros::vector_wrapper;
use super::vector::VectorObservation;
use super::vectors::Vectors;
use super::wrapper::SnapshotWrapper;
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Observes how much of the episode's time has passed.
///
/// The vector of each observation has one more element at the end: the number of steps taken
/// divided by `max_episode_steps`, from 0 to 1, and 1 in episodes that last longer. This is
/// Gymnasium's wrapper of this name with `normalize_time`. Goals stay. Observations reuse memory; a
/// step allocates nothing unless many observations are kept.
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
#[derive(Clone, Debug)]
pub struct TimeAwareObservation<T = f64> {
    max_episode_steps: NonZeroU32,
    elapsed_steps: u32,
    vectors: Vectors<T>,
}

impl<T: Element> TimeAwareObservation<T> {
    /// Adds the time in episodes that last `max_episode_steps`.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::MissingPart`] if the observation space
    /// has no vector of the observations' type.
    #[must_use]
    pub fn new(max_episode_steps: NonZeroU32) -> Self {
        Self { max_episode_steps, elapsed_steps: 0, vectors: Vectors::new() }
    }

    fn make_space(vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        let bounds =
            |bounds: &[T], time| bounds.iter().copied().chain([T::from_f64(time)]).collect();
        let (low, high) = (bounds(vector.low(), 0.0), bounds(vector.high(), 1.0));
        BoxSpace::new(vec![vector.len() + 1], low, high)
    }

    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        self.vectors.check(observation.vector())?;
        self.elapsed_steps = if is_first { 0 } else { self.elapsed_steps.saturating_add(1) };
        let share = f64::from(self.elapsed_steps) / f64::from(self.max_episode_steps.get());
        Ok(self.vectors.replace(observation, |vector, array| {
            for (element, &observed) in array.iter_mut().zip(vector) {
                *element = observed;
            }
            if let Some(time) = array.last_mut() {
                *time = T::from_f64(share.min(1.0));
            }
        }))
    }
}

vector_wrapper!(TimeAwareObservation, |wrapper, vector| {
    wrapper.elapsed_steps = 0;
    Self::make_space(vector)
});

impl<T> SnapshotWrapper for TimeAwareObservation<T> {
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
