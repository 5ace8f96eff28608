//! The errors of wrappers.

/// Error returned when an environment cannot be wrapped.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WrapperError {
    /// A key of an observation that does not exist, or that occurs twice.
    #[error(
        "{key:?} is no further part of the observation: pass achieved_goal, desired_goal or \
         observation, each at most once"
    )]
    Key {
        /// The key.
        key: String,
    },
    /// An element beyond the end of the vector.
    #[error("there is no element {index}: the observation has {len}, so pass smaller indices")]
    Element {
        /// The index.
        index: usize,
        /// Number of elements.
        len: usize,
    },
    /// Nothing is left of the observation.
    #[error("the observation would have no elements: keep at least one")]
    Nothing,
    /// Bounds of actions that are not finite numbers in order.
    #[error("actions cannot lie between {low} and {high}: pass finite bounds, the lower one first")]
    Bounds {
        /// The lower bound.
        low: f64,
        /// The upper bound.
        high: f64,
    },
    /// Actions without bounds cannot be rescaled.
    #[error("the action space is unbounded: only actions between two bounds can be rescaled")]
    Unbounded,
    /// Statistics of vectors of another length.
    #[error(
        "the statistics are of {actual} elements: pass those of {expected}, as the observation has"
    )]
    StatisticsLength {
        /// Number of elements of the observation.
        expected: usize,
        /// Number of elements of the statistics.
        actual: usize,
    },
}

debug_as_display!(WrapperError);
