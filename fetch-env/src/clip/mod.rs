//! Episodes as moving pictures: GIF, which every viewer shows, and lossless APNG.
//!
//! ```
//! use fetch_env::clip::{Caption, Clip};
//!
//! // In place of `env.render(&mut renderer)?`: two frames of 2 x 1 pixels.
//! let frames = [[0, 0, 0, 9, 9, 9], [0, 0, 0, 255, 9, 9]];
//! let mut clip = Clip::new(2, 1)?;
//! clip.push(&frames[0])?;
//! clip.push_with_caption(&frames[1], &Caption { step: 1, reward: -1.0, distance: 0.2 })?;
//! let mut gif = Vec::new();
//! clip.write_gif(&mut gif)?;
//! assert!(gif.starts_with(b"GIF89a"));
//! # Ok::<(), fetch_env::clip::ClipError>(())
//! ```

mod apng;
mod caption;
mod changes;
mod error;
mod gif;

use std::io::Write;

pub use self::{caption::Caption, error::ClipError};

/// Frames of one size, 25 a second: as fast as the robot moves.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    width: u16,
    height: u16,
    frames: Vec<Vec<u8>>,
}

/// Hundredths of a second that a frame is shown: a control step.
const FRAME_DELAY: u16 = 4;

impl Clip {
    /// A clip without frames yet.
    ///
    /// # Errors
    /// [`ClipError::Size`] if a frame had no pixels, or more than 65535 in a row or column.
    pub fn new(width: u32, height: u32) -> Result<Self, ClipError> {
        let side = |length: u32| u16::try_from(length).ok().filter(|&length| length > 0);
        let (Some(w), Some(h)) = (side(width), side(height)) else {
            return Err(ClipError::Size { width, height });
        };
        Ok(Self { width: w, height: h, frames: Vec::new() })
    }

    /// Appends a frame: height x width x 3 (red, green, blue), the top row first.
    ///
    /// # Errors
    /// [`ClipError::FrameLength`] if it is of another size.
    pub fn push(&mut self, rgb: &[u8]) -> Result<(), ClipError> {
        let expected = 3 * usize::from(self.width) * usize::from(self.height);
        if rgb.len() != expected {
            return Err(ClipError::FrameLength { expected, actual: rgb.len() });
        }
        self.frames.push(rgb.to_vec());
        Ok(())
    }

    /// Appends a frame with step, reward and distance written in its upper left corner.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_with_caption(&mut self, rgb: &[u8], caption: &Caption) -> Result<(), ClipError> {
        self.push(rgb)?;
        if let Some(frame) = self.frames.last_mut() {
            caption.draw(frame, self.width.into());
        }
        Ok(())
    }

    /// The frames, as they will be shown.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        self.frames.iter().map(Vec::as_slice)
    }

    /// Writes the clip as a GIF that repeats for ever. It has 256 colors, chosen for all frames
    /// together, so that what stands still does not flicker.
    ///
    /// # Errors
    /// [`ClipError::NoFrames`], or [`ClipError::Io`] if `out` cannot be written to.
    pub fn write_gif(&self, out: impl Write) -> Result<(), ClipError> {
        gif::write(self, out)
    }

    /// Writes the clip as an animated PNG that repeats for ever: every pixel as it was.
    ///
    /// # Errors
    /// [`ClipError::NoFrames`], or [`ClipError::Io`] if `out` cannot be written to.
    pub fn write_apng(&self, out: impl Write) -> Result<(), ClipError> {
        apng::write(self, out)
    }
}

/// Writes one frame, height x width x 3 (red, green, blue), as a PNG.
///
/// # Errors
/// [`ClipError::FrameLength`] if it is of another size, or [`ClipError::Io`] if `out` cannot be
/// written to.
pub fn write_png(rgb: &[u8], width: u32, height: u32, out: impl Write) -> Result<(), ClipError> {
    let mut clip = Clip::new(width, height)?;
    clip.push(rgb)?;
    clip.write_apng(out)
}
