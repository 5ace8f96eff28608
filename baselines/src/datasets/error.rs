//! The error of recording and writing a data set.

use std::io;
use std::path::{Path, PathBuf};

use fetch_env::EnvError;

use crate::policy::PolicyError;

/// Error returned when a data set is recorded or written.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// The environment has settings that its name does not stand for.
    #[error(
        "the environment does not have the settings of {env_id}, so it could not be recreated \
         from the data set: make it from the name, with the built-in or the reference's model"
    )]
    Settings {
        /// The name of the environment with this task and reward.
        env_id: String,
    },
    /// The formats cannot use the data set's name.
    #[error(
        "{name:?} is not a name for a data set: use letters, digits, `-`, `_`, and `/` between \
         parts, and end it with a version such as -v0"
    )]
    Name {
        /// The name.
        name: String,
    },
    /// Something already exists where the data set would be.
    #[error("{} exists already: choose another place, or remove it", path.display())]
    Exists {
        /// The place.
        path: PathBuf,
    },
    /// A file could not be written.
    #[error("{} cannot be written", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// A column of the episode does not have a row for each state or step.
    #[error("{column} has {actual} elements: expected {expected}")]
    Length {
        /// The column.
        column: &'static str,
        /// The number of its elements.
        actual: usize,
        /// The number that fits the episode's rewards and the environment's spaces.
        expected: usize,
    },
    /// A number of the episode is NaN, or infinite in `f32`.
    #[error("{column}[{index}] is {value}: leave the episode out, or find the step it comes from")]
    NotFinite {
        /// The column.
        column: &'static str,
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// There are fewer episodes than the format's own loader needs.
    #[error("there are {episodes} episodes, and this format needs at least {least}: write more")]
    TooFew {
        /// The number of episodes.
        episodes: usize,
        /// The number that is needed.
        least: usize,
    },
    /// The policy does not fit this environment.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The environment failed.
    #[error("the episode with seed {seed} failed")]
    Environment {
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// Arrow refused the columns.
    #[cfg(feature = "minari")]
    #[error("the episode cannot be written as Arrow")]
    Arrow(#[from] arrow_schema::ArrowError),
}

debug_as_display!(DatasetError);

impl DatasetError {
    /// Returns a function that turns an error of the file system into one at `path`.
    pub(super) fn file(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::File { path: path.to_owned(), source }
    }
}
