//! Errors in goals, and the checks that find them.

use std::fmt;

use thiserror::Error;

/// The goal to which an error refers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum GoalRole {
    /// The goal that the state achieves.
    Achieved,
    /// The goal that the task asks for.
    Desired,
}

impl fmt::Display for GoalRole {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Achieved => "achieved_goal",
            Self::Desired => "desired_goal",
        })
    }
}

/// Error returned for goals that have no reward.
#[derive(Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum GoalError {
    /// A goal has no element.
    #[error("a goal has no element: pass goals with at least one")]
    Empty,
    /// The two goals, or the two sides of a batch, have different lengths.
    #[error("achieved_goal has {achieved} elements and desired_goal {desired}: pass equally many")]
    LengthMismatch {
        /// The number of elements of the achieved goal or goals.
        achieved: usize,
        /// The number of elements of the desired goal or goals.
        desired: usize,
    },
    /// A batch does not divide into goals of the given dimension.
    #[error("{len} elements do not divide into goals of {dim}: pass whole goals, row after row")]
    PartialRow {
        /// The number of elements passed.
        len: usize,
        /// The goal's dimension.
        dim: usize,
    },
    /// The caller's output slice does not hold one element per pair.
    #[error("the output holds {actual} elements for {expected} pairs of goals: pass one per pair")]
    OutputLength {
        /// The number of pairs.
        expected: usize,
        /// The length of the output slice.
        actual: usize,
    },
    /// An element of a goal is NaN or infinite.
    #[error(
        "{role}[{index}] is {value} (pair {row} of the call): look for the step that made it, or \
         drop the transition"
    )]
    NotFinite {
        /// Which goal.
        role: GoalRole,
        /// Which pair of the batch; 0 in a call about one pair.
        row: usize,
        /// Which element of that goal.
        index: usize,
        /// The element.
        value: f64,
    },
}
debug_as_display!(GoalError);

/// Checks that two goals can be compared.
///
/// # Errors
/// [`GoalError::LengthMismatch`], [`GoalError::Empty`], or [`GoalError::NotFinite`] for the first
/// element that is NaN or infinite, the achieved goal's first.
pub fn check_goals(achieved_goal: &[f64], desired_goal: &[f64]) -> Result<(), GoalError> {
    let (achieved, desired) = (achieved_goal.len(), desired_goal.len());
    if achieved != desired {
        return Err(GoalError::LengthMismatch { achieved, desired });
    }
    if achieved == 0 {
        return Err(GoalError::Empty);
    }
    check_finite(GoalRole::Achieved, achieved_goal, achieved)?;
    check_finite(GoalRole::Desired, desired_goal, desired)
}

/// Returns an error for the first element of goals of `dim` elements that is not finite.
pub(crate) fn check_finite(role: GoalRole, goals: &[f64], dim: usize) -> Result<(), GoalError> {
    // Block by block without a branch inside, so that the compiler vectorizes it.
    const BLOCK: usize = 64;
    let is_bad = |block: &[f64]| block.iter().fold(false, |bad, value| bad | !value.is_finite());
    if !goals.chunks(BLOCK).any(is_bad) {
        return Ok(());
    }
    match goals.iter().position(|value| !value.is_finite()) {
        None => Ok(()),
        Some(at) => {
            Err(GoalError::NotFinite { role, row: at / dim, index: at % dim, value: goals[at] })
        }
    }
}
