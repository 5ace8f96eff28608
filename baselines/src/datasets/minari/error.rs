//! The error of importing a Minari data set.

use std::io;
use std::path::PathBuf;

use her_relabel::{AddError, ConfigError};

/// Error returned when a Minari data set cannot be imported.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum MinariError {
    /// A file could not be read.
    #[error(
        "{} cannot be read: pass the folder of a data set, which contains the folder data",
        path.display()
    )]
    File {
        /// The file.
        path: PathBuf,
        /// The error of the file system.
        source: io::Error,
    },
    /// The metadata do not describe a data set.
    #[error("{} does not describe a Minari data set", path.display())]
    Metadata {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: serde_json::Error,
    },
    /// The episodes are not in Arrow files.
    #[error(
        "the data set is in the format {format:?}: rewrite it with Minari and \
         data_format=\"arrow\""
    )]
    Format {
        /// The format.
        format: String,
    },
    /// The file of an episode is not one that Minari writes.
    #[error("{} cannot be imported: {problem}", path.display())]
    Arrow {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: &'static str,
    },
    /// There is no such column. The observations of a goal-conditioned environment are a dictionary
    /// with `observation`, `achieved_goal` and `desired_goal`.
    #[error(
        "{} has no column {column}: the observations of an environment with goals are \
         observation, achieved_goal and desired_goal", path.display()
    )]
    Missing {
        /// The file.
        path: PathBuf,
        /// The column, after the names of the structs that contain it.
        column: String,
    },
    /// A column has elements of the wrong type.
    #[error("{column} of {} must have the type {expected}", path.display())]
    Type {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The type that it must have.
        expected: &'static str,
    },
    /// The rows of a column do not fit the buffer.
    #[error(
        "the rows of {column} of {} have {actual} elements, those of the buffer {expected}",
        path.display()
    )]
    Width {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// The number of elements of its rows.
        actual: i32,
        /// The number that the buffer needs.
        expected: usize,
    },
    /// There is not enough memory for the episodes beside the buffer.
    #[error("the episodes do not fit into memory beside the buffer")]
    Memory(#[from] ConfigError),
    /// The buffer rejected an episode.
    #[error("the buffer rejected episode {episode}")]
    Episode {
        /// The number of the episode in the data set.
        episode: u64,
        /// The buffer's error.
        source: AddError,
    },
}

debug_as_display!(MinariError);
