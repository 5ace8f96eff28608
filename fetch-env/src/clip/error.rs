use std::io;

/// Why a clip could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ClipError {
    /// A clip of no pixels, or of too many.
    #[error("a clip of {width} x {height} pixels cannot be: give 1 to 65535 each")]
    Size {
        /// Its width, in pixels.
        width: u32,
        /// Its height, in pixels.
        height: u32,
    },
    /// A frame is not as long as the clip's size says.
    #[error("the frame has {actual} bytes, the clip's have {expected}: height x width x 3")]
    FrameLength {
        /// Bytes of the clip's frames.
        expected: usize,
        /// Bytes of this frame.
        actual: usize,
    },
    /// There is nothing to be written.
    #[error("the clip has no frames: push one before it is written")]
    NoFrames,
    /// The clip could not be written to where the caller wants it.
    #[error("the clip could not be written")]
    Io(#[source] io::Error),
}

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
