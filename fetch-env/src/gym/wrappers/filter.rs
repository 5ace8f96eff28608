//! Some elements of observed vectors.

use super::array::ArrayPool;
use super::macros::vector_wrapper;
use super::vector::{VectorElement, VectorObservation, check_len, vector_space};
use super::wrapped::{Stateless, Wrapped};
use crate::gym::env::Env;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, wrappers::error::WrapperError};

/// An environment that observes only some elements of its vector: no velocities, for example.
///
/// Gymnasium's wrapper of this name selects keys of a dictionary, for which there is
/// [`FlattenObservation::with_keys`](Wrapped::with_keys): here a dictionary is a type with goals,
/// without which it is a vector. The goals stay, and so does the law of goals. Observations share
/// memory that is used again; a step allocates nothing unless many observations are kept.
///
/// ```
/// use fetch_env::{Env, GoalObservation, ObservationField, Task, make_kinematic};
/// use fetch_env::wrappers::FilterObservation;
///
/// let fields = ["grip_pos", "object_pos"].map(|name| ObservationField::find(Task::Push, name));
/// let positions = fields.into_iter().flatten().flat_map(|field| field.range.clone());
/// let mut env = FilterObservation::new(make_kinematic("FetchPush-v4")?, positions)?;
/// let observation = env.reset(Some(0))?.observation;
/// assert_eq!(observation.observation().len(), 6);
/// assert_eq!(observation.observation()[3..], *observation.achieved_goal());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type FilterObservation<E> = Wrapped<E, Filter<VectorElement<E>>>;

/// The wrapper of a [`FilterObservation`].
#[derive(Clone, Debug)]
pub struct Filter<T> {
    /// Number of elements of the whole vector.
    len: usize,
    kept: Vec<usize>,
    observation_space: Space,
    pool: ArrayPool<T>,
}

impl<E: Env<Observation: VectorObservation>> FilterObservation<E> {
    /// Keeps the elements of these indices, in this order.
    ///
    /// # Errors
    /// [`EnvError::Vec`] if the observation space has no vector of the observations' type;
    /// [`EnvError::Wrapper`] if an index exceeds it, or if nothing is kept.
    pub fn new(env: E, kept: impl IntoIterator<Item = usize>) -> Result<Self, EnvError> {
        let space = env.observation_space();
        let vector = vector_space::<E::Observation>(space)?;
        let len = vector.len();
        let indices: Vec<usize> = kept.into_iter().collect();
        if let Some(&index) = indices.iter().find(|&&index| index >= len) {
            return Err(WrapperError::Element { index, len }.into());
        }
        if indices.is_empty() {
            return Err(WrapperError::Nothing.into());
        }
        let bounds = |bounds: &[_]| indices.iter().map(|&index| bounds[index]).collect();
        let kept = BoxSpace::new(vec![indices.len()], bounds(vector.low()), bounds(vector.high()))?;
        let observation_space = E::Observation::replaced_space(space, kept);
        let pool = ArrayPool::new(indices.len());
        Ok(Self::from_parts(env, Filter { len, kept: indices, observation_space, pool }))
    }
}

impl<T: Element> Filter<T> {
    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        _is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        let vector = observation.vector();
        check_len(self.len, vector)?;
        let kept = &self.kept;
        let array = self.pool.write(|array| {
            for (element, &index) in array.iter_mut().zip(kept) {
                *element = vector[index];
            }
        });
        Ok(observation.replace(array))
    }
}

vector_wrapper!(Filter);

impl<T> Stateless for Filter<T> {}
