//! The last few observations as one.

use std::num::NonZeroUsize;

use serde::{Serialize, de::DeserializeOwned};

use super::array::ArrayPool;
use super::macros::vector_wrapper;
use super::vector::{VectorElement, VectorObservation, check_len, vector_space};
use super::wrapped::{SnapshotWrapper, Wrapped};
use crate::gym::env::Env;
use crate::gym::error::EnvError;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
    num_elements,
};

/// An environment that observes the last few vectors at once, the oldest first.
///
/// After a reset all of them are the first, as Gymnasium's `FrameStackObservation` pads by default.
/// Of goal-conditioned observations it stacks the part `observation`; goals are the current ones.
/// (Pictures are stacked by `AddRenderObservation`.) Observations share memory that is used again; a
/// step allocates nothing unless many observations are kept.
///
/// ```
/// use std::num::NonZeroUsize;
/// use fetch_env::{Env, GoalObservation, make_kinematic, wrappers::FrameStack};
///
/// let two = NonZeroUsize::MIN.saturating_add(1);
/// let mut env = FrameStack::new(make_kinematic("FetchReach-v4")?, two)?;
/// let first = env.reset(Some(0))?.observation;
/// let second = env.step(&[1.0, 0.0, 0.0, 0.0])?.observation;
/// assert_eq!(first.observation().len(), 2 * 10);
/// assert_eq!(first.observation()[10..], second.observation()[..10]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type FrameStack<E> = Wrapped<E, Stack<VectorElement<E>>>;

/// The wrapper of a [`FrameStack`].
#[derive(Clone, Debug)]
pub struct Stack<T> {
    /// Number of elements of a vector.
    len: usize,
    /// The last vectors, the oldest first.
    frames: Vec<T>,
    observation_space: Space,
    pool: ArrayPool<T>,
}

impl<E: Env<Observation: VectorObservation>> FrameStack<E> {
    /// Stacks the last `num_frames` observations of `env`, the current one included.
    ///
    /// The space of the vectors gets another axis, the first.
    ///
    /// # Errors
    /// [`EnvError::Vec`] if the observation space has no vector of the observations' type;
    /// [`EnvError::Space`] if the stacked vectors have more than 2^28 elements.
    pub fn new(env: E, num_frames: NonZeroUsize) -> Result<Self, EnvError> {
        let (space, num_frames) = (env.observation_space(), num_frames.get());
        let vector = vector_space::<E::Observation>(space)?;
        let len = vector.len();
        let shape = [&[num_frames], vector.shape()].concat();
        num_elements(&shape)?;
        let (low, high) = (vector.low().repeat(num_frames), vector.high().repeat(num_frames));
        let stacked = BoxSpace::new(shape, low, high)?;
        let observation_space = E::Observation::replaced_space(space, stacked);
        let frames = vec![VectorElement::<E>::default(); num_frames * len];
        let pool = ArrayPool::new(frames.len());
        Ok(Self::from_parts(env, Stack { len, frames, observation_space, pool }))
    }
}

impl<T: Element> Stack<T> {
    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError> {
        let vector = observation.vector();
        check_len(self.len, vector)?;
        let newest = self.frames.len() - self.len;
        if !is_first {
            self.frames.copy_within(self.len.., 0);
        }
        let replaced = if is_first { 0 } else { newest };
        for frame in self.frames[replaced..].chunks_exact_mut(self.len.max(1)) {
            frame.copy_from_slice(vector);
        }
        let frames = &self.frames;
        Ok(observation.replace(self.pool.write(|array| array.copy_from_slice(frames))))
    }
}

vector_wrapper!(Stack);

impl<T: Element + Serialize + DeserializeOwned> SnapshotWrapper for Stack<T> {
    type State = Vec<T>;

    fn state(&self) -> Vec<T> {
        self.frames.clone()
    }

    fn check_state(&self, state: &Vec<T>) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        let (theirs, ours) = (state.len(), self.frames.len());
        if theirs != ours {
            return foreign(format!(
                "its stacked observations have {theirs} elements, these {ours}"
            ));
        }
        // Nor does any space contain NaN.
        if state.iter().any(|&element| element.into().is_nan()) {
            return foreign("its stacked observations contain NaN".into());
        }
        Ok(())
    }

    fn set_state(&mut self, state: &Vec<T>) {
        self.frames.clone_from(state);
    }
}
