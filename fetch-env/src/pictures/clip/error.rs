//! Errors of clips and videos.

use std::{io, path::PathBuf};

use crate::gym::error::EnvError;

/// Error returned when a clip cannot be made or written.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum ClipError {
    /// A clip without pixels, or with too many.
    #[error("a clip cannot have {width} x {height} pixels: pass 1 to 65535 each")]
    Size {
        /// Width, in pixels.
        width: u32,
        /// Height, in pixels.
        height: u32,
    },
    /// The length of a frame does not match the size of the clip.
    #[error("the frame has {actual} bytes: pass {expected}, which is height x width x 3")]
    FrameLength {
        /// Number of bytes of the clip's frames.
        expected: usize,
        /// Number of bytes of this frame.
        actual: usize,
    },
    /// The clip is empty.
    #[error("the clip has no frames: push one before writing it")]
    NoFrames,
    /// The output refused the clip.
    #[error("the clip could not be written ({0}): check its output")]
    Io(#[source] io::Error),
    /// The name prefix of videos is a path.
    #[error("{name_prefix:?} cannot begin a file's name: leave out / \\ : and NUL")]
    NamePrefix {
        /// The prefix.
        name_prefix: String,
    },
    /// The folder or the file of a video cannot be written.
    #[error("the video {} could not be written ({reason}): check its folder", path.display())]
    Video {
        /// The folder or file.
        path: PathBuf,
        /// The message of the operating system or of the encoder.
        reason: String,
    },
}

debug_as_display!(ClipError);

impl From<gif::EncodingError> for ClipError {
    fn from(error: gif::EncodingError) -> Self {
        Self::Io(match error {
            gif::EncodingError::Io(error) => error,
            error => io::Error::other(error),
        })
    }
}

impl From<png::EncodingError> for ClipError {
    fn from(error: png::EncodingError) -> Self {
        Self::Io(match error {
            png::EncodingError::IoError(error) => error,
            error => io::Error::other(error),
        })
    }
}

impl From<ClipError> for EnvError {
    fn from(error: ClipError) -> Self {
        Self::other(error)
    }
}
