//! The vector of numbers in an observation: a whole array, or a part next to the goals.

use std::fmt::Debug;

use super::array::SharedArray;
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::observation::{BatchObservation, GoalRows};
use crate::gym::spaces::{
    DictSpace, Space,
    box_space::{BoxSpace, Element},
};

/// An observation with a vector of numbers, which wrappers can replace.
///
/// In a [`GoalObservation`] it is the part [`observation`](GoalObservation::observation); the goals
/// stay, so the environment remains a [`GoalEnv`](crate::GoalEnv). In an array it is the whole
/// array.
///
/// ```
/// use fetch_env::{Env, make_kinematic, wrappers::VectorObservation};
///
/// let start = make_kinematic("FetchPush-v4")?.reset(Some(0))?.observation;
/// assert_eq!(start.vector().len(), 25);
/// assert_eq!([1.0_f32, 2.0].vector(), [1.0, 2.0]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait VectorObservation: Clone + Debug + PartialEq {
    /// Precision of the vector.
    type Element: Element;
    /// The observation with another vector.
    type Replaced<T: Element>: Clone + Debug + PartialEq;

    /// Returns the vector.
    fn vector(&self) -> &[Self::Element];

    /// Replaces the vector.
    fn replace<T: Element>(self, vector: SharedArray<T>) -> Self::Replaced<T>;

    /// Returns the space of the vector, if `space` describes such observations.
    fn vector_space(space: &Space) -> Option<&BoxSpace<Self::Element>>;

    /// Returns the space of observations from `space` with another vector.
    fn replaced_space<T: Element>(space: &Space, vector: BoxSpace<T>) -> Space;
}

/// Key of the vector in a goal-conditioned observation.
const OBSERVATION: &str = "observation";

impl<O: GoalObservation> VectorObservation for O {
    type Element = O::Element;
    type Replaced<T: Element> = GoalVector<O, T>;

    fn vector(&self) -> &[O::Element] {
        self.observation()
    }

    fn replace<T: Element>(self, observation: SharedArray<T>) -> GoalVector<O, T> {
        GoalVector { observation, original: self }
    }

    fn vector_space(space: &Space) -> Option<&BoxSpace<O::Element>> {
        O::Element::as_box(space.as_dict()?.get(OBSERVATION)?)
    }

    fn replaced_space<T: Element>(space: &Space, vector: BoxSpace<T>) -> Space {
        let vector = (OBSERVATION, vector.into());
        let part = |key| Some((key, space.as_dict()?.get(key)?.clone()));
        let goals = ["achieved_goal", "desired_goal"].into_iter().filter_map(part);
        DictSpace::of_distinct(goals.chain([vector])).into()
    }
}

/// A goal-conditioned observation whose vector a wrapper has replaced.
#[derive(Clone, Debug, PartialEq)]
pub struct GoalVector<O, T> {
    observation: SharedArray<T>,
    original: O,
}

impl<O, T> GoalVector<O, T> {
    /// Returns the observation with its original vector.
    #[must_use]
    pub const fn original(&self) -> &O {
        &self.original
    }
}

impl<O: GoalObservation, T: Element> GoalObservation for GoalVector<O, T> {
    type Element = T;

    fn observation(&self) -> &[T] {
        &self.observation
    }

    fn achieved_goal(&self) -> &[f64] {
        self.original.achieved_goal()
    }

    fn desired_goal(&self) -> &[f64] {
        self.original.desired_goal()
    }
}

impl<O: GoalObservation, T: Element> BatchObservation for GoalVector<O, T> {
    type Rows = GoalRows<T>;
}

macro_rules! arrays {
    ($($array:ty $(, $len:ident)?;)*) => {$(
        impl<T: Element $(, const $len: usize)?> VectorObservation for $array {
            type Element = T;
            type Replaced<U: Element> = SharedArray<U>;

            fn vector(&self) -> &[T] {
                self
            }

            fn replace<U: Element>(self, vector: SharedArray<U>) -> SharedArray<U> {
                vector
            }

            fn vector_space(space: &Space) -> Option<&BoxSpace<T>> {
                T::as_box(space)
            }

            fn replaced_space<U: Element>(_space: &Space, vector: BoxSpace<U>) -> Space {
                vector.into()
            }
        }
    )*};
}

arrays! {
    SharedArray<T>;
    Vec<T>;
    [T; N], N;
}
