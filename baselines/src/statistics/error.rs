//! The error of statistics, and the checks that they make first.

/// Error returned for samples that have no estimate, or cannot be tested.
#[derive(Clone, PartialEq, Eq, thiserror::Error)]
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
    /// The ends of an interval exceed the largest number.
    #[error(
        "the values are so far apart that the ends of their interval exceed the largest number: \
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
    /// There are too many trials for an exact test.
    #[error(
        "the samples have more than {most} trials together: use chi_square, which is as good \
         at that size"
    )]
    TooManyTrials {
        /// The largest number of trials that is tested.
        most: u64,
    },
    /// Two lists that belong together have different lengths.
    #[error("one list has {first} values and the other {second}: pass the same number of both")]
    Lengths {
        /// The length of the first list.
        first: usize,
        /// The length of the second list.
        second: usize,
    },
}

debug_as_display!(StatisticsError);

/// Checks that a sample has values, all of them finite.
pub(super) fn check_finite(sample: &[f64]) -> Result<(), StatisticsError> {
    if sample.is_empty() {
        return Err(StatisticsError::Empty);
    }
    match sample.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(StatisticsError::NotFinite { index }),
        None => Ok(()),
    }
}

/// Checks that there are trials, and no more successes than trials.
pub(super) const fn check_successes(successes: u64, trials: u64) -> Result<(), StatisticsError> {
    if trials == 0 {
        return Err(StatisticsError::Empty);
    }
    if successes > trials {
        return Err(StatisticsError::MoreSuccesses { successes, trials });
    }
    Ok(())
}

pub(super) const fn check_lengths(first: usize, second: usize) -> Result<(), StatisticsError> {
    if first == second { Ok(()) } else { Err(StatisticsError::Lengths { first, second }) }
}
