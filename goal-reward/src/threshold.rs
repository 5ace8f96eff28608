//! The distance threshold of success.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The distance below which a goal counts as reached, in the goals' unit: finite and not negative.
///
/// Serialized as the bare number; deserializing checks it.
///
/// # Example
/// ```
/// use goal_reward::DistanceThreshold;
///
/// assert_eq!(DistanceThreshold::new(0.02)?.get(), 0.02);
/// assert!(DistanceThreshold::new(-1.0).is_err());
/// # Ok::<(), goal_reward::ThresholdError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct DistanceThreshold(f64);

impl DistanceThreshold {
    /// 0.05 m, the threshold of every Fetch task (source: gymnasium-robotics 1.4.2).
    pub const FETCH: Self = Self(0.05);

    /// Creates a threshold of `distance`, in the goals' unit.
    ///
    /// # Errors
    /// [`ThresholdError`] if `distance` is negative, NaN or infinite.
    pub fn new(distance: f64) -> Result<Self, ThresholdError> {
        if distance.is_finite() && distance >= 0.0 {
            Ok(Self(distance))
        } else {
            Err(ThresholdError { value: distance })
        }
    }

    /// Returns the distance, in the goals' unit.
    #[inline]
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for DistanceThreshold {
    type Error = ThresholdError;

    fn try_from(distance: f64) -> Result<Self, ThresholdError> {
        Self::new(distance)
    }
}

impl From<DistanceThreshold> for f64 {
    fn from(threshold: DistanceThreshold) -> Self {
        threshold.0
    }
}

/// Error returned for a distance that is not a valid threshold.
#[derive(Clone, Copy, PartialEq, Error)]
#[error(
    "the distance threshold is {value:?}: choose a finite number from 0 up, such as Fetch's 0.05"
)]
#[non_exhaustive]
pub struct ThresholdError {
    /// The rejected distance.
    pub value: f64,
}
debug_as_display!(ThresholdError);
