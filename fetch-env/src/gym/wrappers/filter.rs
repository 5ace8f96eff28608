//! Selected elements of observed vectors.

use super::changed_vector::{ChangedVector, VectorChange};
use super::wrapper::Stateless;
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Keeps only some elements of the observed vector: for example, no velocities.
///
/// Gymnasium's wrapper of this name selects keys of a dictionary. Here
/// [`FlattenObservation::with_keys`](super::FlattenObservation::with_keys) does that, because a
/// dictionary is a type with goals, and without them it is a vector.
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
pub type FilterObservation<T = f64> = ChangedVector<Kept, T>;

/// The indices of the elements that are kept.
#[derive(Clone, Debug)]
pub struct Kept(Vec<usize>);

impl<T> FilterObservation<T> {
    /// Keeps the elements at these indices, in this order.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] if an index is beyond the vector or if
    /// there are no indices.
    #[must_use]
    pub fn new(kept: impl IntoIterator<Item = usize>) -> Self {
        Self::from_change(Kept(kept.into_iter().collect()))
    }
}

impl<T: Element> VectorChange<T> for Kept {
    type Changed = T;

    fn attach(&mut self, observed: &BoxSpace<T>) -> Result<BoxSpace<T>, EnvError> {
        let (Self(kept), len) = (self, observed.len());
        if let Some(&index) = kept.iter().find(|&&index| index >= len) {
            return Err(SpaceError::Element { index, len }.into());
        }
        if kept.is_empty() {
            return Err(SpaceError::Nothing.into());
        }
        let bounds = |bounds: &[_]| kept.iter().map(|&index| bounds[index]).collect();
        Ok(BoxSpace::new(vec![kept.len()], bounds(observed.low()), bounds(observed.high()))?)
    }

    fn change(&mut self, observed: &[T], _is_first: bool, changed: &mut [T]) {
        for (element, &index) in changed.iter_mut().zip(&self.0) {
            *element = observed[index];
        }
    }
}

impl Stateless for Kept {}
