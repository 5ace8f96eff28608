//! Arrays of numbers within bounds.

use rand::{Rng, RngExt};
use serde::{Deserialize, Serialize};

use super::{Space, element::ArrayElement, error::SpaceError, num_elements};

/// Precision of the numbers of a [`BoxSpace`] or an observation: `f32` or `f64`.
///
/// ```
/// use fetch_env::{BoxSpace, spaces::Element};
///
/// /// Returns the middle of a box's first interval, in either precision.
/// fn middle<T: Element>(space: &BoxSpace<T>) -> T {
///     T::from_f64((space.low()[0].into() + space.high()[0].into()) / 2.0)
/// }
/// assert_eq!(middle(&BoxSpace::uniform(vec![2], 0.0_f32, 1.0)?), 0.5);
/// # Ok::<(), fetch_env::spaces::SpaceError>(())
/// ```
pub trait Element: ArrayElement + Default + PartialOrd + Into<f64> {
    /// Negative infinity, which means no lower bound.
    const NEG_INFINITY: Self;
    /// Infinity, which means no upper bound.
    const INFINITY: Self;

    /// Returns the nearest number of this precision.
    fn from_f64(value: f64) -> Self;

    /// Returns `space` if it is a box of this precision.
    fn as_box(space: &Space) -> Option<&BoxSpace<Self>>;

    /// Returns a box as a space.
    fn space(space: BoxSpace<Self>) -> Space;
}

/// Arrays of a fixed shape, each element within its own closed, possibly unbounded interval.
///
/// Every interval contains at least one finite number. Serializes with `null` for an infinite
/// bound.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Bounds<T>", into = "Bounds<T>")]
#[serde(bound(
    serialize = "T: Element + Serialize",
    deserialize = "T: Element + Deserialize<'de>"
))]
pub struct BoxSpace<T> {
    shape: Vec<usize>,
    low: Vec<T>,
    high: Vec<T>,
}

impl<T: Element> BoxSpace<T> {
    /// Creates the space of arrays of `shape` between `low` and `high`, row-major; an infinite
    /// bound means no bound.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if the shape has more than 2^28 elements;
    /// [`SpaceError::BoundCount`] if `low` or `high` does not have one element for each of the
    /// shape's; [`SpaceError::EmptyInterval`] if a bound is NaN or no finite number lies between
    /// the two bounds of an element.
    pub fn new(shape: Vec<usize>, low: Vec<T>, high: Vec<T>) -> Result<Self, SpaceError> {
        let expected = num_elements(&shape)?;
        if low.len() != expected || high.len() != expected {
            return Err(SpaceError::BoundCount {
                shape,
                expected,
                low: low.len(),
                high: high.len(),
            });
        }
        for (index, (&low, &high)) in low.iter().zip(&high).enumerate() {
            if !(low <= high && low < T::INFINITY && high > T::NEG_INFINITY) {
                return Err(SpaceError::EmptyInterval {
                    index,
                    low: low.into(),
                    high: high.into(),
                });
            }
        }
        Ok(Self { shape, low, high })
    }

    /// Creates the space of arrays of `shape` with the same bounds for every element.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn uniform(shape: Vec<usize>, low: T, high: T) -> Result<Self, SpaceError> {
        let len = num_elements(&shape)?;
        Self::new(shape, vec![low; len], vec![high; len])
    }

    /// Creates the space of vectors of `len` numbers without bounds.
    ///
    /// # Errors
    /// [`SpaceError::TooLarge`] if `len` exceeds 2^28.
    pub fn unbounded(len: usize) -> Result<Self, SpaceError> {
        Self::uniform(vec![len], T::NEG_INFINITY, T::INFINITY)
    }

    /// Returns the length of each axis.
    #[must_use]
    pub fn shape(&self) -> &[usize] {
        &self.shape
    }

    /// Returns the number of elements.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.low.len()
    }

    /// Whether its arrays have no elements.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.low.is_empty()
    }

    /// Returns the lower bounds, row-major; negative infinity where there is none.
    #[must_use]
    pub fn low(&self) -> &[T] {
        &self.low
    }

    /// Returns the upper bounds, row-major; infinity where there is none.
    #[must_use]
    pub fn high(&self) -> &[T] {
        &self.high
    }

    /// Whether every element has both bounds.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.intervals().all(|(low, high)| low > T::NEG_INFINITY && high < T::INFINITY)
    }

    /// Whether `array`, row-major, has the right length and lies within all bounds.
    ///
    /// No box contains NaN. A box without a bound on one side contains that infinity, as in
    /// Gymnasium.
    #[must_use]
    pub fn contains(&self, array: &[T]) -> bool {
        array.len() == self.len()
            && array.iter().zip(self.intervals()).all(|(&x, (low, high))| low <= x && x <= high)
    }

    /// Draws a member, each element independently, from the distribution that Gymnasium uses:
    /// uniform between two bounds, exponential away from a single one, standard normal without any.
    pub fn sample<R: Rng + ?Sized>(&self, rng: &mut R) -> Vec<T> {
        self.intervals().map(|interval| sample_interval(interval, rng)).collect()
    }

    /// Draws a member as [`sample`](Self::sample) does, without allocating.
    ///
    /// # Errors
    /// [`SpaceError::SampleLength`] if `out` does not have [`len`](Self::len) elements.
    pub fn sample_into<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        out: &mut [T],
    ) -> Result<(), SpaceError> {
        let (expected, actual) = (self.len(), out.len());
        if actual != expected {
            return Err(SpaceError::SampleLength { expected, actual });
        }
        for (element, interval) in out.iter_mut().zip(self.intervals()) {
            *element = sample_interval(interval, rng);
        }
        Ok(())
    }

    /// Returns the lower and upper bound of each element.
    pub(crate) fn intervals(&self) -> impl Iterator<Item = (T, T)> + '_ {
        self.low.iter().copied().zip(self.high.iter().copied())
    }
}

fn sample_interval<T: Element, R: Rng + ?Sized>((low, high): (T, T), rng: &mut R) -> T {
    let mut uniform = || rng.random::<f64>();
    let value = match (low > T::NEG_INFINITY, high < T::INFINITY) {
        (true, true) => {
            let share = uniform();
            // In low + (high - low) * share the difference could overflow.
            low.into() * (1.0 - share) + high.into() * share
        }
        (true, false) => low.into() + exponential(uniform()),
        (false, true) => high.into() - exponential(uniform()),
        (false, false) => standard_normal(uniform(), uniform()),
    };
    // Rounding can leave the interval.
    T::from_f64(value.clamp(low.into(), high.into()))
}

/// Returns the inverse of the exponential distribution function of `share` in [0, 1).
fn exponential(share: f64) -> f64 {
    -(-share).ln_1p()
}

/// Returns the transform of Box and Muller, "A note on the generation of random normal deviates",
/// 1958.
fn standard_normal(radius: f64, angle: f64) -> f64 {
    (2.0 * exponential(radius)).sqrt() * (std::f64::consts::TAU * angle).cos()
}

/// The serialized form; `None` means no bound, because JSON has no infinity.
#[derive(Serialize, Deserialize)]
#[serde(rename = "BoxSpace", deny_unknown_fields)]
struct Bounds<T> {
    shape: Vec<usize>,
    low: Vec<Option<T>>,
    high: Vec<Option<T>>,
}

impl<T: Element> From<BoxSpace<T>> for Bounds<T> {
    fn from(space: BoxSpace<T>) -> Self {
        let low = space.low.into_iter().map(|low| (low > T::NEG_INFINITY).then_some(low));
        let high = space.high.into_iter().map(|high| (high < T::INFINITY).then_some(high));
        Self { shape: space.shape, low: low.collect(), high: high.collect() }
    }
}

impl<T: Element> TryFrom<Bounds<T>> for BoxSpace<T> {
    type Error = SpaceError;

    fn try_from(bounds: Bounds<T>) -> Result<Self, SpaceError> {
        let low = bounds.low.into_iter().map(|low| low.unwrap_or(T::NEG_INFINITY));
        let high = bounds.high.into_iter().map(|high| high.unwrap_or(T::INFINITY));
        Self::new(bounds.shape, low.collect(), high.collect())
    }
}

macro_rules! element {
    ($($float:ident: $space:ident),*) => {$(
        impl Element for $float {
            const NEG_INFINITY: Self = Self::NEG_INFINITY;
            const INFINITY: Self = Self::INFINITY;

            fn from_f64(value: f64) -> Self {
                value as Self
            }

            fn as_box(space: &Space) -> Option<&BoxSpace<Self>> {
                match space {
                    Space::$space(space) => Some(space),
                    _ => None,
                }
            }

            fn space(space: BoxSpace<Self>) -> Space {
                Space::$space(space)
            }
        }
    )*};
}

element!(f32: BoxF32, f64: BoxF64);
