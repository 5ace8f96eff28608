//! Errors of spaces.

/// Error returned for an invalid space.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpaceError {
    /// The number of bounds does not match the shape.
    #[error(
        "a box of shape {shape:?} has {low} lower and {high} upper bounds: pass {expected} each"
    )]
    BoundCount {
        /// The shape.
        shape: Vec<usize>,
        /// Number of elements of that shape.
        expected: usize,
        /// Number of lower bounds.
        low: usize,
        /// Number of upper bounds.
        high: usize,
    },
    /// A shape with more elements than a space may have.
    #[error("arrays of shape {shape:?} have more than {most} elements: pass smaller lengths")]
    TooLarge {
        /// The shape.
        shape: Vec<usize>,
        /// The largest number of elements.
        most: usize,
    },
    /// No number lies between the bounds of an element.
    #[error(
        "element {index} of the box has no number between {low} and {high}: pass low <= high, \
         neither NaN"
    )]
    EmptyInterval {
        /// Index of the element, row-major.
        index: usize,
        /// Lower bound of the element.
        low: f64,
        /// Upper bound of the element.
        high: f64,
    },
    /// A slice for a sample has the wrong length.
    #[error("the slice for a sample has {actual} elements: pass {expected}")]
    SampleLength {
        /// Number of elements of the space.
        expected: usize,
        /// Number of elements of the slice.
        actual: usize,
    },
    /// An element without choices, or with choices that no `i64` can hold.
    #[error(
        "element {index} has {n} choices from {start} on: pass at least one, the last within i64"
    )]
    Choices {
        /// Index of the element.
        index: usize,
        /// Number of choices.
        n: u64,
        /// The smallest choice.
        start: i64,
    },
    /// The number of smallest choices does not match the number of elements.
    #[error("there are {actual} smallest choices: pass {expected}, one for each element")]
    StartCount {
        /// Number of elements.
        expected: usize,
        /// Number of smallest choices.
        actual: usize,
    },
    /// Two spaces of a dictionary have the same key.
    #[error("the key {key:?} occurs twice: name each space of a dictionary differently")]
    DuplicateKey {
        /// The key.
        key: String,
    },
    /// The observation space lacks a part of the observations.
    #[error(
        "the observation space has no {key} with elements of type {element}: make \
         observation_space() describe what the environment observes"
    )]
    MissingPart {
        /// Key of the missing part.
        key: &'static str,
        /// Type of its elements.
        element: &'static str,
    },
    /// An unknown or repeated key of an observation.
    #[error(
        "unknown or repeated key {key:?}: pass achieved_goal, desired_goal or observation, each at \
         most once"
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
        "the statistics have {actual} elements: pass {expected}, the length of the observation"
    )]
    StatisticsLength {
        /// Number of elements of the observation.
        expected: usize,
        /// Number of elements of the statistics.
        actual: usize,
    },
}

debug_as_display!(SpaceError);
