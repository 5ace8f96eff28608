//! The error of loading a buffer.

use std::io;

use thiserror::Error;

use crate::store::config::ConfigError;

/// The version of the file format that is written and read.
pub(crate) const VERSION: u32 = 1;

/// Error returned when a buffer cannot be loaded.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum LoadError {
    /// The file cannot be read.
    #[error("the buffer cannot be read: {0}")]
    Io(#[source] io::Error),
    /// The file is not a saved buffer.
    #[error("this is not a saved replay buffer: pass a file that HerBuffer::save wrote")]
    Foreign,
    /// The file was written by another version of this crate.
    #[error(
        "the buffer was saved in format {version} instead of {VERSION}: load it with the version of her-relabel that saved it"
    )]
    Version {
        /// The version of the file's format.
        version: u32,
    },
    /// The buffer was saved with elements of the other type.
    #[error(
        "the buffer has elements of {actual} bytes instead of {expected}: load it as HerBuffer<f32> for 4 and HerBuffer<f64> for 8"
    )]
    ElementSize {
        /// The requested size, in bytes.
        expected: usize,
        /// The size in the file.
        actual: u32,
    },
    /// The file ends too early.
    #[error("the file ends before the buffer does: copy it again, as a whole")]
    Truncated,
    /// The contents differ from what was saved.
    #[error("the file is damaged: use an older copy")]
    Damaged,
    /// The file holds settings that no buffer can have.
    #[error("the file is damaged, use an older copy: {0}")]
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
