//! Spaces: the actions that an environment takes and the observations that it returns.
//!
//! No array has more than 2^28 elements (255 stacked pictures of 640 x 480, or 2 GiB of `f64`).
//! Sampling a dictionary that was read from a file can allocate that much for each of its spaces.
//!
//! Samples come from any generator of `rand_core`; [`NpRandom`](crate::NpRandom) is one that
//! needs no further crate. A seed determines the sample. The distributions are Gymnasium's; the
//! numbers are not, because numpy draws them by other methods.
//!
//! ```
//! use fetch_env::{BoxSpace, DictSpace, DiscreteSpace, NpRandom, Space};
//!
//! let space: Space = DictSpace::new([
//!     ("gear", DiscreteSpace::new(5)?.into()),
//!     ("speed", BoxSpace::<f32>::uniform(vec![2], -1.0, 1.0)?.into()),
//! ])?
//! .into();
//! let sample = space.sample(&mut NpRandom::new(7));
//! assert!(space.contains(&sample));
//! assert_eq!(sample, space.sample(&mut NpRandom::new(7)));
//! # Ok::<(), fetch_env::spaces::SpaceError>(())
//! ```

pub(crate) mod box_space;
pub(crate) mod discrete;
pub(crate) mod element;
pub(crate) mod error;

use goal_reward::Dims;
use rand_core::Rng;
use serde::{Deserialize, Deserializer, Serialize, de::Error};

pub use self::{
    box_space::{BoxSpace, Element},
    discrete::{DiscreteSpace, MultiBinarySpace, MultiDiscreteSpace},
    element::ArrayElement,
    error::SpaceError,
};

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
    /// One of several choices.
    Discrete(DiscreteSpace),
    /// Several choices at once.
    MultiDiscrete(MultiDiscreteSpace),
    /// Several choices between true and false.
    MultiBinary(MultiBinarySpace),
    /// Named spaces.
    Dict(DictSpace),
}

/// A value to test against a [`Space`]. Arrays are row-major.
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
    /// An array of choices, of one element in a [`DiscreteSpace`].
    I64(Vec<i64>),
    /// An array of booleans.
    Bool(Vec<bool>),
    /// Named values.
    Dict(Vec<(String, Value)>),
}

impl Space {
    /// Whether `value` has the space's kind and shape and lies within all bounds, without a NaN.
    #[must_use]
    pub fn contains(&self, value: &Value) -> bool {
        match (self, value) {
            (Self::BoxF32(space), Value::F32(array)) => space.contains(array),
            (Self::BoxF64(space), Value::F64(array)) => space.contains(array),
            (Self::Image(space), Value::U8(array)) => space.contains(array),
            (Self::Discrete(space), Value::I64(array)) => space.contains(array),
            (Self::MultiDiscrete(space), Value::I64(array)) => space.contains(array),
            (Self::MultiBinary(space), Value::Bool(array)) => space.contains(array),
            (Self::Dict(space), Value::Dict(values)) => space.contains(values),
            _ => false,
        }
    }

    /// Draws a member as the space of its kind does, such as [`BoxSpace::sample`].
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Value {
        match self {
            Self::BoxF32(space) => Value::F32(space.sample(rng)),
            Self::BoxF64(space) => Value::F64(space.sample(rng)),
            Self::Image(space) => Value::U8(space.sample(rng)),
            Self::Discrete(space) => Value::I64(space.sample(rng).into()),
            Self::MultiDiscrete(space) => Value::I64(space.sample(rng)),
            Self::MultiBinary(space) => Value::Bool(space.sample(rng)),
            Self::Dict(space) => Value::Dict(space.sample(rng)),
        }
    }

    /// Returns the dictionary if the space is one.
    #[must_use]
    pub const fn as_dict(&self) -> Option<&DictSpace> {
        match self {
            Self::Dict(space) => Some(space),
            _ => None,
        }
    }

    /// Returns the lengths of observations and goals if this is the space of what a goal-conditioned
    /// environment observes, with that of its actions.
    ///
    /// # Errors
    /// [`SpaceError::MissingPart`] if the space has no observation or no goals of `f32` or `f64`.
    pub fn dims(&self, action: usize) -> Result<Dims, SpaceError> {
        let len = |key| {
            let part = self.as_dict().and_then(|dict| dict.get(key));
            let len = part.and_then(|part| f32::len_in(part).or_else(|| f64::len_in(part)));
            len.ok_or(SpaceError::MissingPart { key, element: "f32 or f64" })
        };
        Ok(Dims { observation: len("observation")?, goal: len("desired_goal")?, action })
    }
}

macro_rules! space_from {
    ($($variant:ident($space:ty)),*) => {$(
        impl From<$space> for Space {
            fn from(space: $space) -> Self {
                Self::$variant(space)
            }
        }
    )*};
}

space_from!(
    Image(ImageSpace),
    Discrete(DiscreteSpace),
    MultiDiscrete(MultiDiscreteSpace),
    MultiBinary(MultiBinarySpace),
    Dict(DictSpace)
);

impl<T: Element> From<BoxSpace<T>> for Space {
    fn from(space: BoxSpace<T>) -> Self {
        T::space(space)
    }
}

/// Named spaces in a fixed order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DictSpace {
    #[serde(deserialize_with = "distinct")]
    spaces: Vec<(String, Space)>,
}

impl DictSpace {
    /// Creates a dictionary of spaces in the given order.
    ///
    /// # Errors
    /// [`SpaceError::DuplicateKey`] if two spaces have the same name.
    pub fn new(
        spaces: impl IntoIterator<Item = (impl Into<String>, Space)>,
    ) -> Result<Self, SpaceError> {
        let mut dict = Self { spaces: Vec::new() };
        for (key, space) in spaces {
            let key = key.into();
            if dict.get(&key).is_some() {
                return Err(SpaceError::DuplicateKey { key });
            }
            dict.spaces.push((key, space));
        }
        Ok(dict)
    }

    /// Creates a dictionary of spaces whose names are known to differ.
    pub(crate) fn of_distinct(spaces: impl IntoIterator<Item = (&'static str, Space)>) -> Self {
        Self { spaces: spaces.into_iter().map(|(key, space)| (key.into(), space)).collect() }
    }

    /// Returns the space of this name.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<&Space> {
        self.iter().find_map(|(name, space)| (name == key).then_some(space))
    }

    /// Iterates over names and spaces in order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (&str, &Space)> {
        self.spaces.iter().map(|(key, space)| (key.as_str(), space))
    }

    /// Whether `values` has exactly one value for each space, in any order, and each lies in its
    /// space.
    #[must_use]
    pub fn contains(&self, values: &[(String, Value)]) -> bool {
        values.len() == self.spaces.len()
            && self.iter().all(|(key, space)| {
                values.iter().any(|(name, value)| name == key && space.contains(value))
            })
    }

    /// Draws a member of each space, in order.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<(String, Value)> {
        self.spaces.iter().map(|(key, space)| (key.clone(), space.sample(rng))).collect()
    }
}

/// Deserializes spaces whose keys differ.
fn distinct<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<(String, Space)>, D::Error> {
    let spaces = Vec::<(String, Space)>::deserialize(deserializer)?;
    Ok(DictSpace::new(spaces).map_err(D::Error::custom)?.spaces)
}

/// The largest number of elements of an array.
const MAX_ELEMENTS: usize = 1 << 28;

/// Returns the number of elements of a shape, unless it is too large.
pub(crate) fn num_elements(shape: &[usize]) -> Result<usize, SpaceError> {
    let len = shape.iter().try_fold(1_usize, |len, axis| len.checked_mul(*axis));
    len.filter(|len| *len <= MAX_ELEMENTS)
        .ok_or_else(|| SpaceError::TooLarge { shape: shape.into(), most: MAX_ELEMENTS })
}

/// Images, or stacks of them: arrays of bytes of a fixed shape, each from 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "ImageShape")]
pub struct ImageSpace {
    shape: [usize; 3],
}

impl ImageSpace {
    /// Creates the space of row-major arrays of `shape`.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if the shape has more than 2^28 elements.
    pub fn new(shape: [usize; 3]) -> Result<Self, SpaceError> {
        num_elements(&shape)?;
        Ok(Self { shape })
    }

    /// Returns the length of each axis.
    #[must_use]
    pub const fn shape(&self) -> [usize; 3] {
        self.shape
    }

    /// Returns the number of bytes.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.shape[0] * self.shape[1] * self.shape[2]
    }

    /// Whether its arrays have no elements.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Whether `array`, row-major, has the right length.
    #[must_use]
    pub const fn contains(&self, array: &[u8]) -> bool {
        array.len() == self.len()
    }

    /// Draws a member, each byte independently and uniformly.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<u8> {
        let mut bytes = vec![0; self.len()];
        rng.fill_bytes(&mut bytes);
        bytes
    }
}

/// The serialized form of an [`ImageSpace`].
#[derive(Deserialize)]
#[serde(rename = "ImageSpace", deny_unknown_fields)]
struct ImageShape {
    shape: [usize; 3],
}

impl TryFrom<ImageShape> for ImageSpace {
    type Error = SpaceError;

    fn try_from(ImageShape { shape }: ImageShape) -> Result<Self, SpaceError> {
        Self::new(shape)
    }
}
