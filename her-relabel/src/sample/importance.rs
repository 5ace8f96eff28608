//! What makes up for drawing some transitions more often than others.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Scalar;
use crate::sample::batch::Batch;
use crate::store::storage::Storage;

/// How far importance weights make up for the priorities: from 0, not at all, to 1, fully.
///
/// A row drawn with probability `P` from `N` transitions has the weight `(N * P)^-beta`, divided by the
/// highest weight of the batch. Prioritized replay raises beta to 1 toward the end of training.
///
/// Source: Schaul et al., *Prioritized experience replay*, 2016, section 3.4; there the highest weight is
/// that of the whole buffer, whereas most libraries take the batch's, as here.
///
/// # Example
/// ```
/// use her_relabel::Beta;
///
/// assert_eq!(Beta::new(0.4)?.get(), 0.4);
/// assert!(Beta::new(-1.0).is_err());
/// # Ok::<(), her_relabel::BetaError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Beta(f64);

impl Beta {
    /// No correction: all weights are 1.
    pub const NONE: Self = Self(0.0);
    /// Full correction.
    pub const FULL: Self = Self(1.0);

    /// The exponent `beta`.
    ///
    /// # Errors
    /// [`BetaError`] if it is not between 0 and 1.
    pub fn new(beta: f64) -> Result<Self, BetaError> {
        if (0.0..=1.0).contains(&beta) { Ok(Self(beta)) } else { Err(BetaError { beta }) }
    }

    /// The exponent, from 0 to 1.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Computes the importance weights of the gathered rows.
    pub(crate) fn weigh<T: Scalar>(self, storage: &Storage<T>, batch: &mut Batch<T>) {
        let Some(table) = &storage.priorities else { return };
        let Batch { columns, scratch } = batch;
        let shares =
            columns.transition.iter().map(|id| table.share(&storage.episodes, id.number()));
        scratch.shares.clear();
        scratch.shares.extend(shares);
        let least = scratch.shares.iter().copied().fold(f64::INFINITY, f64::min);
        for (weight, share) in columns.importance_weight.iter_mut().zip(&scratch.shares) {
            // The least probable row has the highest weight, by which all are divided.
            *weight = T::from_f64((least / share).powf(self.0));
        }
    }
}

impl TryFrom<f64> for Beta {
    type Error = BetaError;

    fn try_from(beta: f64) -> Result<Self, BetaError> {
        Self::new(beta)
    }
}

impl From<Beta> for f64 {
    fn from(beta: Beta) -> Self {
        beta.0
    }
}

/// A number that is no exponent of importance weights.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("beta lies between 0 and 1, but it is {beta}; 0.4 is a usual start")]
#[non_exhaustive]
pub struct BetaError {
    /// The number that was refused.
    pub beta: f64,
}
