//! The number type of ratios, discounts and exponents.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A finite number from 0 to 1: a relabel ratio, a discount per step, or the exponent of importance
/// weights.
///
/// Serialized as a plain number, which is checked when it is read.
///
/// # Example
/// ```
/// use her_relabel::UnitInterval;
///
/// assert_eq!(UnitInterval::new(0.98)?.get(), 0.98);
/// assert_eq!(UnitInterval::from_k(4).get(), 0.8);
/// assert!(UnitInterval::new(1.1).is_err());
/// # Ok::<(), her_relabel::UnitIntervalError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct UnitInterval(f64);

impl UnitInterval {
    /// 0: no relabeling, no later rewards, or no correction.
    pub const ZERO: Self = Self(0.0);
    /// 1: every row relabeled, no discount, or full correction.
    pub const ONE: Self = Self(1.0);

    /// Checks that `value` is from 0 to 1.
    ///
    /// # Errors
    /// [`UnitIntervalError`] if it is less than 0, more than 1, or NaN.
    pub fn new(value: f64) -> Result<Self, UnitIntervalError> {
        if (0.0..=1.0).contains(&value) {
            Ok(Self(value))
        } else {
            Err(UnitIntervalError { value })
        }
    }

    /// Returns the relabel ratio `k / (k + 1)`: `k` relabeled transitions for each original one.
    /// This is the paper's `k`, and the `n_sampled_goal` of other libraries.
    #[must_use]
    pub fn from_k(k: u32) -> Self {
        Self(f64::from(k) / (f64::from(k) + 1.0))
    }

    /// Returns the number.
    #[inline]
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for UnitInterval {
    type Error = UnitIntervalError;

    fn try_from(value: f64) -> Result<Self, UnitIntervalError> {
        Self::new(value)
    }
}

impl From<UnitInterval> for f64 {
    fn from(value: UnitInterval) -> Self {
        value.0
    }
}

/// Error returned for a number outside of the unit interval.
#[derive(Clone, Copy, PartialEq, Error)]
#[error("{value:?} is not a number from 0 to 1: pass one")]
#[non_exhaustive]
pub struct UnitIntervalError {
    /// The rejected number.
    pub value: f64,
}
debug_as_display!(UnitIntervalError);
