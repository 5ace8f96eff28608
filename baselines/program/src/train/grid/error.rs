//! The errors of a grid's file or folder.

use std::{fmt::Display, path::PathBuf};

/// Error returned for a grid that cannot be run.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    #[error("the file is not a grid")]
    Json(#[from] serde_json::Error),
    #[error("there is no key {key}; did you mean {nearest}?")]
    UnknownKey { key: String, nearest: &'static str },
    #[error("{key}: {reason}")]
    Value { key: &'static str, reason: String },
    #[error("{key} is empty: give it at least one value, or leave it out")]
    Empty { key: String },
    #[error("{what} appears twice: leave one out")]
    Repeated { what: String },
    #[error("the grid has {num_runs} runs: choose at most {most}, or several grids")]
    TooMany { num_runs: usize, most: usize },
    #[error(
        "{} has the runs of another grid, which differs in {difference}: choose another folder \
         with --out, or undo the change to the file",
        folder.display()
    )]
    Changed { folder: PathBuf, difference: String },
    #[error(
        "{} exists, but there is no grid.json beside it, so it may not belong to a grid: choose \
         another folder with --out",
        path.display()
    )]
    Taken { path: PathBuf },
}

impl GridError {
    pub fn value(key: &'static str, reason: &impl Display) -> Self {
        Self::Value { key, reason: reason.to_string() }
    }
}
