//! The time in the episode as part of the observation.

use std::num::NonZeroU32;

use super::array::ArrayPool;
use super::macros::vector_wrapper;
use super::vector::{VectorElement, VectorObservation, check_len, vector_space};
use super::wrapped::{SnapshotWrapper, Wrapped};
use crate::gym::env::Env;
use crate::gym::error::EnvError;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};

/// An environment that observes how much of its time has passed.
///
/// The vector of each observation has one more element, the last: the number of steps taken divided
/// by `max_episode_steps`, from 0 to 1, and 1 in episodes that last longer. That is Gymnasium's
/// wrapper of this name with `normalize_time`. Goals stay. Observations share memory that is used
/// again; a step allocates nothing unless many observations are kept.
///
/// ```
/// use fetch_env::{Env, GoalObservation, make_kinematic, wrappers::TimeAwareObservation};
///
/// let env = make_kinematic("FetchReach-v4")?;
/// let steps = env.max_episode_steps();
/// let mut env = TimeAwareObservation::new(env, steps)?;
/// assert_eq!(env.reset(Some(0))?.observation.observation()[10], 0.0);
/// assert_eq!(env.step(&[0.0; 4])?.observation.observation()[10], 0.02);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type TimeAwareObservation<E> = Wrapped<E, TimeAware<VectorElement<E>>>;

/// The wrapper of a [`TimeAwareObservation`].
#[derive(Clone, Debug)]
pub struct TimeAware<T> {
    max_episode_steps: NonZeroU32,
    elapsed_steps: u32,
    /// Number of elements without the time.
    len: usize,
    observation_space: Space,
    pool: ArrayPool<T>,
}

impl<E: Env<Observation: VectorObservation>> TimeAwareObservation<E> {
    /// Adds the time to the observations of `env`, whose episodes last `max_episode_steps`.
    ///
    /// # Errors
    /// [`EnvError::Vec`] if the observation space has no vector of the observations' type.
    pub fn new(env: E, max_episode_steps: NonZeroU32) -> Result<Self, EnvError> {
        let space = env.observation_space();
        let vector = vector_space::<E::Observation>(space)?;
        let len = vector.len();
        let bounds = |bounds: &[VectorElement<E>], time| {
            let time = VectorElement::<E>::from_f64(time);
            bounds.iter().copied().chain([time]).collect()
        };
        let (low, high) = (bounds(vector.low(), 0.0), bounds(vector.high(), 1.0));
        let timed = BoxSpace::new(vec![len + 1], low, high)?;
        let observation_space = E::Observation::replaced_space(space, timed);
        let pool = ArrayPool::new(len + 1);
        let wrapper =
            TimeAware { max_episode_steps, elapsed_steps: 0, len, observation_space, pool };
        Ok(Self::from_parts(env, wrapper))
    }
}

impl<T: Element> TimeAware<T> {
    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        let vector = observation.vector();
        check_len(self.len, vector)?;
        self.elapsed_steps = if is_first { 0 } else { self.elapsed_steps.saturating_add(1) };
        let share = f64::from(self.elapsed_steps) / f64::from(self.max_episode_steps.get());
        let array = self.pool.write(|array| {
            for (element, &observed) in array.iter_mut().zip(vector) {
                *element = observed;
            }
            if let Some(time) = array.last_mut() {
                *time = T::from_f64(share.min(1.0));
            }
        });
        Ok(observation.replace(array))
    }
}

vector_wrapper!(TimeAware);

impl<T> SnapshotWrapper for TimeAware<T> {
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
