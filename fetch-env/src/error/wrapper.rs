//! The errors of wrappers.

#[cfg(all(feature = "clip", feature = "render"))]
use std::{
    fmt,
    path::{Path, PathBuf},
};

/// Error returned when an environment cannot be wrapped.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
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

/// Error returned when an episode cannot be recorded.
#[cfg(all(feature = "clip", feature = "render"))]
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VideoError {
    /// A name prefix that is a path.
    #[error("{name_prefix:?} cannot begin a file's name: leave out / \\ : and NUL")]
    NamePrefix {
        /// The prefix.
        name_prefix: String,
    },
    /// The folder or the file cannot be written.
    #[error("the video {} could not be written ({reason}): check its folder", path.display())]
    Write {
        /// The folder or file.
        path: PathBuf,
        /// The message of the operating system or of the encoder.
        reason: String,
    },
}

#[cfg(all(feature = "clip", feature = "render"))]
impl VideoError {
    pub(crate) fn write(path: &Path, reason: &dyn fmt::Display) -> Self {
        Self::Write { path: path.into(), reason: reason.to_string() }
    }
}
