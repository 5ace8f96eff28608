//! Why a buffer cannot be loaded.

use std::io;

use thiserror::Error;

use crate::ConfigError;
use crate::save::persist::VERSION;

/// Why no buffer can be loaded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file cannot be read.
    #[error("the buffer cannot be read: {0}")]
    Io(#[source] io::Error),
    /// The file is something else.
    #[error("this is no saved replay buffer; pass a file that HerBuffer::save wrote")]
    Foreign,
    /// The file was written by another version of this crate.
    #[error(
        "the buffer was saved in format {version}, and this is format {VERSION}; load it with the version of her-relabel that saved it"
    )]
    Version {
        /// The version of the file's format.
        version: u32,
    },
    /// The buffer was saved with elements of the other type.
    #[error(
        "the buffer has elements of {actual} bytes, not {expected}; load it as HerBuffer<f32> for 4 and HerBuffer<f64> for 8"
    )]
    ElementSize {
        /// The size asked for, in bytes.
        expected: usize,
        /// The size in the file.
        actual: u32,
    },
    /// The file ends too early.
    #[error("the file ends before the buffer does; it was not copied whole")]
    Truncated,
    /// The file is not what was saved.
    #[error("the file is damaged; use an older copy")]
    Damaged,
    /// The file holds sizes that no buffer can have.
    #[error("the file is damaged: {0}")]
    Config(#[from] ConfigError),
}

impl From<io::Error> for LoadError {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::UnexpectedEof => Self::Truncated,
            _ => Self::Io(error),
        }
    }
}
