//! The error of the tests, and the checks that they make first.

/// Error returned for samples that cannot be tested.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TestError {
    /// A sample is empty.
    #[error("a sample is empty: pass at least one value")]
    Empty,
    /// A value is NaN or infinite.
    #[error("value {index} of a sample is not finite: leave it out, or find where it comes from")]
    NotFinite {
        /// The index of the value, counted from 0.
        index: usize,
    },
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

pub(crate) fn check_finite(sample: &[f64]) -> Result<(), TestError> {
    if sample.is_empty() {
        return Err(TestError::Empty);
    }
    match sample.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(TestError::NotFinite { index }),
        None => Ok(()),
    }
}

pub(crate) const fn check_successes(successes: u64, trials: u64) -> Result<(), TestError> {
    if trials == 0 {
        return Err(TestError::Empty);
    }
    if successes > trials {
        return Err(TestError::MoreSuccesses { successes, trials });
    }
    Ok(())
}

pub(crate) const fn check_lengths(first: usize, second: usize) -> Result<(), TestError> {
    if first == second { Ok(()) } else { Err(TestError::Lengths { first, second }) }
}
