//! Why a sample has no estimate, and what estimates check first.

/// Error returned for a sample that has no estimate.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StatisticsError {
    /// A sample is empty.
    #[error("a sample is empty: pass at least one value")]
    Empty,
    /// A value is NaN or infinite.
    #[error("value {index} of a sample is not finite: leave it out, or find where it comes from")]
    NotFinite {
        /// The value, counted from 0.
        index: usize,
    },
    /// The ends of an interval are beyond the largest number.
    #[error(
        "the values are so far apart that no number is as large as the ends of their interval: \
         divide them by a constant"
    )]
    TooFarApart,
    /// There are more successes than trials.
    #[error("{successes} of {trials} trials succeeded: pass the successes first, then the trials")]
    MoreSuccesses {
        /// The number of successes.
        successes: u64,
        /// The number of trials.
        trials: u64,
    },
}

pub(super) fn check_finite(sample: &[f64]) -> Result<(), StatisticsError> {
    if sample.is_empty() {
        return Err(StatisticsError::Empty);
    }
    match sample.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(StatisticsError::NotFinite { index }),
        None => Ok(()),
    }
}

pub(super) const fn check_successes(successes: u64, trials: u64) -> Result<(), StatisticsError> {
    if trials == 0 {
        return Err(StatisticsError::Empty);
    }
    if successes > trials {
        return Err(StatisticsError::MoreSuccesses { successes, trials });
    }
    Ok(())
}
