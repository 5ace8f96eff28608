//! The last few observations: stacked into one, or the oldest of them.

use std::num::NonZeroUsize;

use serde::{Serialize, de::DeserializeOwned};

use super::macros::vector_wrapper;
use super::vector::VectorObservation;
use super::vectors::Vectors;
use super::wrapper::SnapshotWrapper;
use crate::gym::spaces::{
    box_space::{BoxSpace, Element},
    num_elements,
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Observes the last few vectors at once, the oldest first.
///
/// After a reset all of them are the first vector, as Gymnasium's `FrameStackObservation` pads by
/// default. In goal-conditioned observations it stacks the part `observation`; the goals are the
/// current ones. (`AddRenderObservation` stacks pictures.) The space of the vectors gets a new
/// first axis. Observations reuse memory; a step allocates nothing unless many observations are
/// kept.
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
#[derive(Clone, Debug)]
pub struct FrameStack<T = f64> {
    num_frames: NonZeroUsize,
    frames: Frames<T>,
    vectors: Vectors<T>,
}

impl<T: Element> FrameStack<T> {
    /// Stacks the last `num_frames` observations, the current one included.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::TooLarge`] if the stacked vectors have
    /// more than 2^28 elements, and [`SpaceError::MissingPart`] if the observation space has no
    /// vector of the observations' type.
    #[must_use]
    pub fn new(num_frames: NonZeroUsize) -> Self {
        Self { num_frames, frames: Frames(Vec::new()), vectors: Vectors::new() }
    }

    /// Makes room for the stacked vectors, and their space.
    fn make_space(&mut self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        let num_frames = self.num_frames.get();
        let shape = [&[num_frames], vector.shape()].concat();
        num_elements(&shape)?;
        let (low, high) = (vector.low().repeat(num_frames), vector.high().repeat(num_frames));
        self.frames = Frames(vec![T::default(); low.len()]);
        BoxSpace::new(shape, low, high)
    }

    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        let vector = observation.vector();
        self.vectors.check(vector)?;
        self.frames.push(vector, is_first);
        let frames = &self.frames.0;
        Ok(self.vectors.replace(observation, |_, array| array.copy_from_slice(frames)))
    }
}

vector_wrapper!(FrameStack, |wrapper, vector| wrapper.make_space(vector));

impl<T: Element + Serialize + DeserializeOwned> SnapshotWrapper for FrameStack<T> {
    type State = Vec<T>;

    fn state(&self) -> Vec<T> {
        self.frames.0.clone()
    }

    fn check_state(&self, state: &Vec<T>) -> Result<(), EnvError> {
        self.frames.check_state(state)
    }

    fn set_state(&mut self, state: &Vec<T>) {
        self.frames.0.clone_from(state);
    }
}

/// Observes the vector of some steps ago. Until there is one, it observes the first of the episode.
///
/// In goal-conditioned observations it delays the part `observation`; the goals, and so the rewards,
/// are the current ones. Observations reuse memory; a step allocates nothing unless many
/// observations are kept.
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
#[derive(Clone, Debug)]
pub struct DelayObservation<T = f64> {
    steps: u8,
    frames: Frames<T>,
    vectors: Vectors<T>,
}

impl<T: Element> DelayObservation<T> {
    /// Delays observations by `steps`, where 0 changes nothing.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::MissingPart`] if the observation space
    /// has no vector of the observations' type.
    #[must_use]
    pub fn new(steps: u8) -> Self {
        Self { steps, frames: Frames(Vec::new()), vectors: Vectors::new() }
    }

    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        self.vectors.check(observation.vector())?;
        self.frames.push(observation.vector(), is_first);
        let frames = &self.frames.0;
        Ok(self.vectors.replace(observation, |_, array| {
            array.copy_from_slice(&frames[..array.len()]);
        }))
    }
}

vector_wrapper!(DelayObservation, |wrapper, vector| {
    wrapper.frames = Frames(vec![T::default(); (usize::from(wrapper.steps) + 1) * vector.len()]);
    Ok(vector.clone())
});

impl<T: Element + Serialize + DeserializeOwned> SnapshotWrapper for DelayObservation<T> {
    type State = Vec<T>;

    fn state(&self) -> Vec<T> {
        self.frames.0.clone()
    }

    fn check_state(&self, state: &Vec<T>) -> Result<(), EnvError> {
        self.frames.check_state(state)
    }

    fn set_state(&mut self, state: &Vec<T>) {
        self.frames.0.clone_from(state);
    }
}

/// The last vectors, the oldest first.
#[derive(Clone, Debug)]
struct Frames<T>(Vec<T>);

impl<T: Element> Frames<T> {
    /// Adds a vector in place of the oldest one; the first vector of an episode in place of all.
    fn push(&mut self, vector: &[T], is_first: bool) {
        let Self(frames) = self;
        if !is_first {
            frames.copy_within(vector.len().., 0);
        }
        let replaced = if is_first { 0 } else { frames.len() - vector.len() };
        for frame in frames[replaced..].chunks_exact_mut(vector.len().max(1)) {
            frame.copy_from_slice(vector);
        }
    }

    fn check_state(&self, state: &[T]) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        let (theirs, ours) = (state.len(), self.0.len());
        if theirs != ours {
            return foreign(format!("its last observations have {theirs} elements, these {ours}"));
        }
        // Nor does any space contain NaN.
        if state.iter().any(|&element| element.into().is_nan()) {
            return foreign("its last observations contain NaN".into());
        }
        Ok(())
    }
}
