//! The last few observations: stacked into one, or the oldest of them.

use std::fmt::Debug;
use std::num::NonZeroUsize;

use serde::{Serialize, de::DeserializeOwned};

use super::changed_vector::{ChangedVector, VectorChange};
use super::wrapper::SnapshotWrapper;
use crate::gym::spaces::{
    box_space::{BoxSpace, Element},
    num_elements,
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Observes the last few vectors at once, the oldest first.
///
/// After a reset all of them are the first vector, as Gymnasium's `FrameStackObservation` pads by
/// default; the goals are the current ones. (`AddRenderObservation` stacks pictures.) The space of
/// the vectors gets a new first axis.
///
/// ```
/// use std::num::NonZeroUsize;
/// use fetch_env::{Env, EnvExt, GoalObservation, make_kinematic, wrappers::FrameStack};
///
/// let two = NonZeroUsize::MIN.saturating_add(1);
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(FrameStack::new(two))?;
/// let first = env.reset(Some(0))?.observation;
/// let second = env.step(&[1.0, 0.0, 0.0, 0.0])?.observation;
/// assert_eq!(first.observation().len(), 2 * 10);
/// assert_eq!(first.observation()[10..], second.observation()[..10]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type FrameStack<T = f64> = ChangedVector<LastVectors<T, Stacked>, T>;

/// The number of vectors that are observed at once.
#[derive(Clone, Copy, Debug)]
pub struct Stacked(NonZeroUsize);

impl<T: Element> FrameStack<T> {
    /// Stacks the last `num_frames` observations, the current one included.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::TooLarge`] if the stacked vectors have
    /// more than 2^28 elements.
    #[must_use]
    pub fn new(num_frames: NonZeroUsize) -> Self {
        LastVectors::observed_as(Stacked(num_frames))
    }
}

impl Observed for Stacked {
    fn num_vectors(&self) -> usize {
        self.0.get()
    }

    fn space<T: Element>(&self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        let num_vectors = self.num_vectors();
        let shape = [&[num_vectors], vector.shape()].concat();
        num_elements(&shape)?;
        BoxSpace::new(shape, vector.low().repeat(num_vectors), vector.high().repeat(num_vectors))
    }
}

/// Observes the vector of some steps ago. Until there is one, it observes the first of the episode.
///
/// The goals, and so the rewards, are the current ones.
///
/// ```
/// use fetch_env::{Env, EnvExt, GoalObservation, make_kinematic, wrappers::DelayObservation};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(DelayObservation::new(1))?;
/// let first = env.reset(Some(0))?.observation;
/// let second = env.step(&[1.0, 0.0, 0.0, 0.0])?.observation;
/// assert_eq!(second.observation(), first.observation());
/// assert_ne!(second.achieved_goal(), first.achieved_goal());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type DelayObservation<T = f64> = ChangedVector<LastVectors<T, Oldest>, T>;

/// The number of steps by which observations are late.
#[derive(Clone, Copy, Debug)]
pub struct Oldest(u8);

impl<T: Element> DelayObservation<T> {
    /// Delays observations by `steps`, where 0 changes nothing.
    #[must_use]
    pub fn new(steps: u8) -> Self {
        LastVectors::observed_as(Oldest(steps))
    }
}

impl Observed for Oldest {
    fn num_vectors(&self) -> usize {
        usize::from(self.0) + 1
    }

    fn space<T: Element>(&self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        Ok(vector.clone())
    }
}

/// What is observed of the last vectors: as many elements as its space has, the oldest first.
pub trait Observed: Debug {
    /// Returns the number of vectors that are kept.
    fn num_vectors(&self) -> usize;

    /// Returns the space of what is observed, given that of a vector.
    fn space<T: Element>(&self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError>;
}

/// The last vectors, the oldest first.
#[derive(Clone, Debug)]
pub struct LastVectors<T, O> {
    observed: O,
    elements: Vec<T>,
}

impl<T, O> LastVectors<T, O> {
    fn observed_as(observed: O) -> ChangedVector<Self, T> {
        ChangedVector::from_change(Self { observed, elements: Vec::new() })
    }
}

impl<T: Element, O: Observed> VectorChange<T> for LastVectors<T, O> {
    type Changed = T;

    fn attach(&mut self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, EnvError> {
        let space = self.observed.space(vector)?;
        self.elements = vec![T::default(); self.observed.num_vectors() * vector.len()];
        Ok(space)
    }

    /// Adds a vector in place of the oldest one; the first vector of an episode in place of all.
    fn change(&mut self, vector: &[T], is_first: bool, observed: &mut [T]) {
        let Self { elements, .. } = self;
        if !is_first {
            elements.copy_within(vector.len().., 0);
        }
        let replaced = if is_first { 0 } else { elements.len() - vector.len() };
        for kept in elements[replaced..].chunks_exact_mut(vector.len().max(1)) {
            kept.copy_from_slice(vector);
        }
        observed.copy_from_slice(&elements[..observed.len()]);
    }
}

impl<T, O> SnapshotWrapper for LastVectors<T, O>
where
    T: Element + Serialize + DeserializeOwned,
{
    type State = Vec<T>;

    fn state(&self) -> Vec<T> {
        self.elements.clone()
    }

    fn check_state(&self, state: &Vec<T>) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        let (theirs, ours) = (state.len(), self.elements.len());
        if theirs != ours {
            return foreign(format!("its last observations have {theirs} elements, these {ours}"));
        }
        // Nor does any space contain NaN.
        if state.iter().any(|&element| element.into().is_nan()) {
            return foreign("its last observations contain NaN".into());
        }
        Ok(())
    }

    fn set_state(&mut self, state: &Vec<T>) {
        self.elements.clone_from(state);
    }
}
