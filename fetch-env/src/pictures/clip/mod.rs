//! Episodes as moving pictures: GIF, which every viewer shows, and lossless APNG.
//!
//! ```
//! use fetch_env::clip::Clip;
//!
//! // Frames come from `env.render(&mut renderer)?`; these two have 2 x 1 pixels.
//! let frames = [[0, 0, 0, 9, 9, 9], [0, 0, 0, 255, 9, 9]];
//! let mut clip = Clip::new(2, 1)?;
//! clip.push(&frames[0])?;
//! clip.push_with_caption(&frames[1], "step 1\nreward -1.0")?;
//! let mut gif = Vec::new();
//! clip.write_gif(&mut gif)?;
//! assert!(gif.starts_with(b"GIF89a"));
//! # Ok::<(), fetch_env::clip::ClipError>(())
//! ```

mod encode;
mod error;
#[cfg(feature = "render")]
pub(crate) mod record_video;

use std::io::Write;

use font8x8::legacy::BASIC_LEGACY;

pub use self::error::ClipError;

/// Frames of one size, shown at 25 per second, the pace of the robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Clip {
    /// Width and height, in pixels.
    size: [u16; 2],
    frames: Vec<Vec<u8>>,
}

impl Clip {
    /// Creates a clip without frames.
    ///
    /// # Errors
    /// [`ClipError::Size`] if the width or height is not 1 to 65535 pixels.
    pub fn new(width: u32, height: u32) -> Result<Self, ClipError> {
        let side = |length: u32| u16::try_from(length).ok().filter(|&length| length > 0);
        match (side(width), side(height)) {
            (Some(width), Some(height)) => Ok(Self { size: [width, height], frames: Vec::new() }),
            _ => Err(ClipError::Size { width, height }),
        }
    }

    /// Appends a frame: height x width x 3 (red, green, blue), the top row first.
    ///
    /// # Errors
    /// [`ClipError::FrameLength`] if it has another size.
    pub fn push(&mut self, rgb: &[u8]) -> Result<(), ClipError> {
        let expected = 3 * self.size.map(usize::from).into_iter().product::<usize>();
        if rgb.len() != expected {
            return Err(ClipError::FrameLength { expected, actual: rgb.len() });
        }
        self.frames.push(rgb.to_vec());
        Ok(())
    }

    /// Appends a frame with lines of ASCII text written in its upper left corner.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_with_caption(&mut self, rgb: &[u8], caption: &str) -> Result<(), ClipError> {
        self.push(rgb)?;
        if let Some(frame) = self.frames.last_mut() {
            draw_text(frame, self.size[0].into(), caption);
        }
        Ok(())
    }

    /// Iterates over the frames, captions included.
    pub fn frames(&self) -> impl ExactSizeIterator<Item = &[u8]> {
        self.frames.iter().map(Vec::as_slice)
    }

    /// Writes the clip as a GIF that repeats forever. All frames share one palette of 256 colors,
    /// so that static parts do not flicker.
    ///
    /// # Errors
    /// [`ClipError::NoFrames`], or [`ClipError::Io`] if `out` cannot be written to.
    pub fn write_gif(&self, out: impl Write) -> Result<(), ClipError> {
        encode::write_gif(&self.frames, self.size, out)
    }

    /// Writes the clip as a lossless animated PNG that repeats forever.
    ///
    /// # Errors
    /// [`ClipError::NoFrames`], or [`ClipError::Io`] if `out` cannot be written to.
    pub fn write_apng(&self, out: impl Write) -> Result<(), ClipError> {
        encode::write_apng(&self.frames, self.size, out)
    }
}

/// Width and height of a letter of the font, in dots.
const LETTER: usize = 8;
/// Width of a frame, in pixels, for each pixel of a dot; the text then leaves most of it free.
const PIXELS_PER_DOT: usize = 240;

/// Writes lines in white on the darkened upper left corner, as far as they fit.
fn draw_text(rgb: &mut [u8], width: usize, text: &str) {
    let scale = (width / PIXELS_PER_DOT).max(1);
    let lines: Vec<&str> = text.lines().collect();
    let letters = lines.iter().map(|line| line.len()).max().unwrap_or(0);
    let (margin, line) = (LETTER / 2 * scale, (LETTER + 2) * scale);
    let (right, bottom) = (2 * margin + letters * LETTER * scale, 2 * margin + lines.len() * line);
    for (y, row) in rgb.chunks_exact_mut(3 * width).enumerate().take(bottom) {
        for (x, pixel) in row.chunks_exact_mut(3).enumerate().take(right) {
            let dot = x.checked_sub(margin).zip(y.checked_sub(margin)).is_some_and(|(x, y)| {
                let text = lines.get(y / line).copied().unwrap_or_default();
                is_dot(text, x / scale, y % line / scale)
            });
            for value in pixel {
                *value = if dot { 255 } else { *value / 3 };
            }
        }
    }
}

/// Whether a text has a dot at these coordinates, counted from its upper left corner.
fn is_dot(text: &str, x: usize, y: usize) -> bool {
    let letter = text.as_bytes().get(x / LETTER).copied().unwrap_or(b' ');
    let rows = BASIC_LEGACY.get(usize::from(letter)).unwrap_or(&BASIC_LEGACY[0]);
    rows.get(y).is_some_and(|row| row >> (x % LETTER) & 1 == 1)
}

/// Writes one frame, height x width x 3 (red, green, blue), as a PNG.
///
/// # Errors
/// [`ClipError::Size`] or [`ClipError::FrameLength`] if the sizes do not fit, or [`ClipError::Io`]
/// if `out` cannot be written to.
pub fn write_png(rgb: &[u8], width: u32, height: u32, out: impl Write) -> Result<(), ClipError> {
    let mut clip = Clip::new(width, height)?;
    clip.push(rgb)?;
    clip.write_apng(out)
}
