//! Selected elements of observed vectors.

use super::macros::vector_wrapper;
use super::vector::VectorObservation;
use super::vectors::Vectors;
use super::wrapper::Stateless;
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Keeps only some elements of the observed vector: for example, no velocities.
///
/// Gymnasium's wrapper of this name selects keys of a dictionary. Here
/// [`FlattenObservation::with_keys`](super::FlattenObservation::with_keys) does that, because a
/// dictionary is a type with goals, and without them it is a vector. The goals stay, and so does
/// the law of goals. Observations reuse memory; a step allocates nothing unless many observations
/// are kept.
///
/// ```
/// use fetch_env::{Env, EnvExt, GoalObservation, ObservationField, Task, make_kinematic};
/// use fetch_env::wrappers::FilterObservation;
///
/// let fields = ["grip_pos", "object_pos"].map(|name| ObservationField::find(Task::Push, name));
/// let positions = fields.into_iter().flatten().flat_map(|field| field.range.clone());
/// let mut env = make_kinematic("FetchPush-v4")?.wrap(FilterObservation::new(positions))?;
/// let observation = env.reset(Some(0))?.observation;
/// assert_eq!(observation.observation().len(), 6);
/// assert_eq!(observation.observation()[3..], *observation.achieved_goal());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug)]
pub struct FilterObservation<T = f64> {
    kept: Vec<usize>,
    vectors: Vectors<T>,
}

impl<T: Element> FilterObservation<T> {
    /// Keeps the elements at these indices, in this order.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] if an index is beyond the vector, if
    /// there are no indices, or if the observation space has no vector of the observations' type.
    #[must_use]
    pub fn new(kept: impl IntoIterator<Item = usize>) -> Self {
        Self { kept: kept.into_iter().collect(), vectors: Vectors::new() }
    }

    fn make_space(kept: &[usize], vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        let len = vector.len();
        if let Some(&index) = kept.iter().find(|&&index| index >= len) {
            return Err(SpaceError::Element { index, len });
        }
        if kept.is_empty() {
            return Err(SpaceError::Nothing);
        }
        let bounds = |bounds: &[_]| kept.iter().map(|&index| bounds[index]).collect();
        BoxSpace::new(vec![kept.len()], bounds(vector.low()), bounds(vector.high()))
    }

    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        _is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        self.vectors.check(observation.vector())?;
        let kept = &self.kept;
        Ok(self.vectors.replace(observation, |vector, array| {
            for (element, &index) in array.iter_mut().zip(kept) {
                *element = vector[index];
            }
        }))
    }
}

vector_wrapper!(FilterObservation, |wrapper, vector| Self::make_space(&wrapper.kept, vector));

impl<T> Stateless for FilterObservation<T> {}
