//! Why episodes cannot be imported.

use std::io;

use thiserror::Error;

use crate::AddError;

/// Why episodes cannot be imported. The buffer is as it was before the call.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The archive cannot be read, or is none.
    #[error("the archive cannot be read: {0}; pass a file of numpy.savez or HerBuffer::export_npz")]
    Archive(#[from] io::Error),
    /// The archive has no such array.
    #[error(
        "the archive has no array `{array}`; see HerBuffer::export_npz for all that there must be"
    )]
    Missing {
        /// The array.
        array: String,
    },
    /// An array is damaged, or has a form that is not read.
    #[error("the array `{array}` cannot be read: {source}; write it anew")]
    Array {
        /// The array.
        array: String,
        /// What was found.
        source: io::Error,
    },
    /// An array has elements of the wrong type.
    #[error("`{array}` has elements of type {actual}; convert it to {expected}")]
    Type {
        /// The array.
        array: String,
        /// What it should have.
        expected: &'static str,
        /// Its type in numpy's notation.
        actual: String,
    },
    /// An array has the wrong shape.
    #[error("`{array}` has the shape {actual:?}, and should have {rows} rows of {width} numbers")]
    Shape {
        /// The array.
        array: String,
        /// The number of rows it should have.
        rows: u64,
        /// The length of a row.
        width: usize,
        /// Its shape.
        actual: Vec<u64>,
    },
    /// The lengths of the episodes are wrong.
    #[error(
        "`episode_lengths` does not add up: {found} steps up to episode {episode}, and `rewards` has {expected}; lengths are the steps of an episode, at least 1"
    )]
    Lengths {
        /// The episode that is too long, or the last one.
        episode: u64,
        /// The steps of all episodes up to that one.
        found: u64,
        /// The steps that there are.
        expected: u64,
    },
    /// An episode cannot be added.
    #[error("episode {episode} cannot be added: {source}")]
    Episode {
        /// The episode, from 0.
        episode: u64,
        /// What is wrong with it.
        source: AddError,
    },
}
