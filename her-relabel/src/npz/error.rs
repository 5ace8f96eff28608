//! The error of importing episodes.

use std::io;

use thiserror::Error;

use crate::add::check::AddError;

/// Error returned when episodes cannot be imported. The buffer is unchanged.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum NpzError {
    /// The archive cannot be read, or the file is not an archive.
    #[error(
        "the archive cannot be read ({0}): pass a file written by numpy.savez or HerBuffer::export_npz"
    )]
    Archive(#[from] io::Error),
    /// An array is missing.
    #[error(
        "the archive has no array `{array}`: write all arrays that HerBuffer::export_npz lists"
    )]
    Missing {
        /// The array.
        array: String,
    },
    /// An array is damaged, or has an unsupported form.
    #[error("the array `{array}` cannot be read ({source}): write it again")]
    Array {
        /// The array.
        array: String,
        /// The cause.
        source: io::Error,
    },
    /// An array has elements of the wrong type.
    #[error("`{array}` has elements of type {actual}: convert it to {expected}")]
    Type {
        /// The array.
        array: String,
        /// The accepted types.
        expected: &'static str,
        /// Its type in numpy's notation.
        actual: String,
    },
    /// An array has the wrong shape.
    #[error("`{array}` has the shape {actual:?}: give it {rows} rows of {width} elements")]
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
        "`episode_lengths` has {found} steps up to episode {episode}, but `rewards` has {expected}: make each length the number of steps of its episode, at least 1"
    )]
    Lengths {
        /// The first episode that is too long, or the last one.
        episode: u64,
        /// The steps of all episodes up to this one.
        found: u64,
        /// The number of rewards.
        expected: u64,
    },
    /// An episode cannot be added.
    #[error("episode {episode} cannot be added: {source}")]
    Episode {
        /// The episode, from 0.
        episode: u64,
        /// The cause.
        source: AddError,
    },
}
