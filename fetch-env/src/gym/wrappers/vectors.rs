//! The vectors that a wrapper makes from the observed ones.

use super::array::ArrayPool;
use super::vector::VectorObservation;
use crate::gym::env::Env;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Key of the vector in a goal-conditioned observation.
const OBSERVATION: &str = "observation";

/// The space of the vectors that a wrapper makes from the observed ones, and memory for them.
///
/// Until it has an environment it makes empty vectors.
#[derive(Clone, Debug)]
pub(super) struct Vectors<T> {
    /// The number of elements of an observed vector.
    observed_len: usize,
    /// `None` without an environment.
    observation_space: Option<Space>,
    pool: ArrayPool<T>,
}

impl<T> Vectors<T> {
    pub(super) fn new() -> Self {
        Self { observed_len: 0, observation_space: None, pool: ArrayPool::new(0) }
    }
}

impl<T: Element> Vectors<T> {
    /// Prepares vectors whose space `make_space` makes from that of the observed ones.
    ///
    /// # Errors
    /// [`SpaceError::MissingPart`] if the observation space has no vector of the observations'
    /// type, and the errors of `make_space`.
    pub(super) fn attach<E: Env<Observation: VectorObservation>>(
        &mut self,
        env: &E,
        make_space: impl FnOnce(
            &BoxSpace<<E::Observation as VectorObservation>::Element>,
        ) -> Result<BoxSpace<T>, SpaceError>,
    ) -> Result<(), EnvError> {
        let space = env.observation_space();
        let element = std::any::type_name::<<E::Observation as VectorObservation>::Element>();
        let missing = || SpaceError::MissingPart { key: OBSERVATION, element };
        let observed = E::Observation::vector_space(space).ok_or_else(missing)?;
        let made = make_space(observed)?;
        self.observed_len = observed.len();
        self.pool = ArrayPool::new(made.len());
        self.observation_space = Some(E::Observation::replaced_space(space, made));
        Ok(())
    }

    /// Returns the space of the observations with the new vectors.
    pub(super) fn observation_space<'a, E: Env>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }

    /// Returns the number of elements of a new vector.
    pub(super) const fn len(&self) -> usize {
        self.pool.len()
    }

    /// Fails unless a vector has the length of its space.
    pub(super) fn check<U>(&self, vector: &[U]) -> Result<(), EnvError> {
        let (expected, actual) = (self.observed_len, vector.len());
        if actual == expected {
            return Ok(());
        }
        Err(EnvError::ObservationLength { key: OBSERVATION, expected, actual })
    }

    /// Replaces the vector of a [checked](Self::check) observation with one that `fill` writes.
    pub(super) fn replace<O: VectorObservation>(
        &mut self,
        observation: O,
        fill: impl FnOnce(&[O::Element], &mut [T]),
    ) -> O::Replaced<T> {
        let array = self.pool.write(|array| fill(observation.vector(), array));
        observation.replace(array)
    }
}
