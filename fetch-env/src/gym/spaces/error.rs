//! The errors of spaces.

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
    /// A shape of more elements than a space may have.
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
    #[error(
        "the slice for a sample has {actual} elements: pass {expected}, as many as the space has"
    )]
    SampleLength {
        /// Number of elements of the space.
        expected: usize,
        /// Number of elements of the slice.
        actual: usize,
    },
    /// An element without choices, or with some that no `i64` can hold.
    #[error(
        "element {index} has {n} choices from {start} on: pass at least one, the last of them an \
         i64"
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
    #[error("there are {actual} smallest choices: pass {expected}, as many as elements")]
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
}

debug_as_display!(SpaceError);
