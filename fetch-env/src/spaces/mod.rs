//! Spaces: which actions an environment takes and which observations it gives.

mod box_space;
mod dict_space;
mod image_space;

use rand_core::Rng;
use serde::{Deserialize, Serialize};

pub use box_space::{BoxSpace, Element};
pub use dict_space::DictSpace;
pub use image_space::ImageSpace;

/// What can be wrong with a space's definition.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpaceError {
    /// The bounds are not as many as the shape says.
    #[error(
        "a box of shape {shape:?} needs {expected} bounds, but {low} low and {high} high were given"
    )]
    BoundCount {
        /// The shape.
        shape: Vec<usize>,
        /// Elements of that shape.
        expected: usize,
        /// Lower bounds given.
        low: usize,
        /// Upper bounds given.
        high: usize,
    },
    /// No number lies between the bounds of an element.
    #[error(
        "element {index} of the box has no number between {low} and {high}: give low <= high, neither NaN"
    )]
    EmptyInterval {
        /// Index of the element, row-major.
        index: usize,
        /// Its lower bound.
        low: f64,
        /// Its upper bound.
        high: f64,
    },
    /// The room for a sample does not fit the space.
    #[error(
        "a sample has {expected} elements, but there is room for {actual}: pass a slice of the space's length"
    )]
    SampleLength {
        /// Elements of the space.
        expected: usize,
        /// Elements of the slice.
        actual: usize,
    },
    /// A key comes twice.
    #[error("the key {key:?} comes twice: name each space of a dictionary differently")]
    DuplicateKey {
        /// The key.
        key: String,
    },
}

/// A set of values that can be described, tested and sampled.
///
/// Serializes with a `type` tag; an infinite bound is `null`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Space {
    /// Arrays of single precision.
    BoxF32(BoxSpace<f32>),
    /// Arrays of double precision.
    BoxF64(BoxSpace<f64>),
    /// Images of bytes.
    Image(ImageSpace),
    /// Spaces by name.
    Dict(DictSpace),
}

/// A value that may or may not lie in a [`Space`]. Arrays are row-major.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", content = "value", rename_all = "snake_case")]
#[non_exhaustive]
pub enum Value {
    /// An array of single precision.
    F32(Vec<f32>),
    /// An array of double precision.
    F64(Vec<f64>),
    /// An array of bytes.
    U8(Vec<u8>),
    /// Values by name.
    Dict(Vec<(String, Value)>),
}

impl Space {
    /// Whether `value` is of the space's kind and shape, within all bounds, and without a NaN.
    #[must_use]
    pub fn contains(&self, value: &Value) -> bool {
        match (self, value) {
            (Self::BoxF32(space), Value::F32(array)) => space.contains(array),
            (Self::BoxF64(space), Value::F64(array)) => space.contains(array),
            (Self::Image(space), Value::U8(array)) => space.contains(array),
            (Self::Dict(space), Value::Dict(values)) => space.contains(values),
            _ => false,
        }
    }

    /// A random member, as [`BoxSpace::sample`] and [`ImageSpace::sample`] draw it.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Value {
        match self {
            Self::BoxF32(space) => Value::F32(space.sample(rng)),
            Self::BoxF64(space) => Value::F64(space.sample(rng)),
            Self::Image(space) => Value::U8(space.sample(rng)),
            Self::Dict(space) => Value::Dict(space.sample(rng)),
        }
    }

    /// The dictionary, if it is one.
    #[must_use]
    pub const fn as_dict(&self) -> Option<&DictSpace> {
        match self {
            Self::Dict(space) => Some(space),
            _ => None,
        }
    }
}

impl From<BoxSpace<f32>> for Space {
    fn from(space: BoxSpace<f32>) -> Self {
        Self::BoxF32(space)
    }
}

impl From<BoxSpace<f64>> for Space {
    fn from(space: BoxSpace<f64>) -> Self {
        Self::BoxF64(space)
    }
}

impl From<ImageSpace> for Space {
    fn from(space: ImageSpace) -> Self {
        Self::Image(space)
    }
}

impl From<DictSpace> for Space {
    fn from(space: DictSpace) -> Self {
        Self::Dict(space)
    }
}
