//! Episodes as moving pictures: GIF, which every viewer shows, and lossless APNG.
//!
//! ```
//! use fetch_env::clip::{Caption, Clip};
//!
//! // Frames come from `env.render(&mut renderer)?`; these two have 2 x 1 pixels.
//! let frames = [[0, 0, 0, 9, 9, 9], [0, 0, 0, 255, 9, 9]];
//! let mut clip = Clip::new(2, 1)?;
//! clip.push(&frames[0])?;
//! clip.push_with_caption(&frames[1], &Caption { step: 1, reward: -1.0, distance: 0.2 })?;
//! let mut gif = Vec::new();
//! clip.write_gif(&mut gif)?;
//! assert!(gif.starts_with(b"GIF89a"));
//! # Ok::<(), fetch_env::clip::ClipError>(())
//! ```

mod encode;
#[cfg(feature = "render")]
pub(crate) mod record_video;
#[cfg(feature = "render")]
pub(crate) mod video_options;

use std::io::Write;

use font8x8::legacy::BASIC_LEGACY;

pub use self::encode::ClipError;

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

    /// Appends a frame with step, reward and distance written in its upper left corner.
    ///
    /// # Errors
    /// As [`push`](Self::push).
    pub fn push_with_caption(&mut self, rgb: &[u8], caption: &Caption) -> Result<(), ClipError> {
        self.push(rgb)?;
        if let Some(frame) = self.frames.last_mut() {
            caption.draw(frame, self.size[0].into());
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

/// Text on a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Caption {
    /// Number of steps since the reset.
    pub step: u32,
    /// Reward of the last step.
    pub reward: f64,
    /// Distance between achieved and desired goal, in meters.
    pub distance: f64,
}

/// Width and height of a letter of the font, in dots.
const LETTER: usize = 8;
/// Width of a frame, in pixels, for each pixel of a dot; the text then leaves most of it free.
const PIXELS_PER_DOT: usize = 240;

impl Caption {
    fn lines(&self) -> [String; 3] {
        [
            format!("step     {:3}", self.step),
            format!("reward   {:6.3}", self.reward + 0.0), // turns -0 into 0
            format!("distance {:6.3} m", self.distance),
        ]
    }

    /// Writes the lines in white on the darkened upper left corner, as far as they fit.
    fn draw(&self, rgb: &mut [u8], width: usize) {
        let scale = (width / PIXELS_PER_DOT).max(1);
        let lines = self.lines();
        let letters = lines.iter().map(String::len).max().unwrap_or(0);
        let (margin, line) = (LETTER / 2 * scale, (LETTER + 2) * scale);
        let (right, bottom) =
            (2 * margin + letters * LETTER * scale, 2 * margin + lines.len() * line);
        for (y, row) in rgb.chunks_exact_mut(3 * width).enumerate().take(bottom) {
            for (x, pixel) in row.chunks_exact_mut(3).enumerate().take(right) {
                let dot = x.checked_sub(margin).zip(y.checked_sub(margin)).is_some_and(|(x, y)| {
                    let text = lines.get(y / line).map_or("", String::as_str);
                    is_dot(text, x / scale, y % line / scale)
                });
                for value in pixel {
                    *value = if dot { 255 } else { *value / 3 };
                }
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
