//! Errors in goals.

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
    /// A goal is empty.
    #[error("a goal is empty: pass goals of at least one element")]
    Empty,
    /// The two goals, or the two sides of a batch, have different lengths.
    #[error(
        "achieved_goal has {achieved} elements and desired_goal {desired}: pass the same number"
    )]
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
    /// The output slice does not hold one element per pair.
    #[error("the output holds {actual} elements for {expected} pairs of goals: pass one per pair")]
    OutputLength {
        /// The number of pairs.
        expected: usize,
        /// The length of the output slice.
        actual: usize,
    },
    /// An element of a goal is NaN or infinite.
    #[error(
        "{role}[{index}] is {value:?} (pair {row} of the call): look for the step that made it, or \
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
