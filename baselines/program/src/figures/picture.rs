//! Drawings, as PNG and as SVG.

use std::sync::OnceLock;

use anyhow::anyhow;
use base64::{Engine, prelude::BASE64_STANDARD};
use fetch_env::clip::write_png;
use plotters::{coord::Shift, prelude::*, style};

/// Why a drawing failed.
pub type DrawError = Box<dyn std::error::Error + Send + Sync>;

/// The area of a drawing.
pub type Area<B> = DrawingArea<B, Shift>;

/// Any of plotters' backends.
pub trait Backend: DrawingBackend<ErrorType: 'static> {}

impl<B: DrawingBackend<ErrorType: 'static>> Backend for B {}

/// The font family of all texts. PNG is drawn with DejaVu Sans, the same on every machine; the
/// viewer of an SVG chooses the font.
pub const FONT: &str = "sans-serif";

/// A drawing by plotters, on any backend.
pub trait Drawing {
    /// Returns the width and the height, in pixels: at most 2^26 pixels in all.
    fn size(&self) -> (u32, u32);

    /// Draws everything onto a white area of this size.
    fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError>;

    /// Returns a rendered picture that covers a part of the drawing; `None` by default.
    fn frame(&self) -> Option<Frame<'_>> {
        None
    }
}

/// A rendered picture within a drawing.
pub struct Frame<'a> {
    /// Position of its upper left corner, in pixels.
    pub at: (usize, usize),
    /// Width and height, in pixels.
    pub size: (u32, u32),
    /// Height x width x 3 (red, green, blue), the top row first.
    pub rgb: &'a [u8],
}

/// A drawing in both formats.
pub struct Picture {
    /// The file's contents as SVG.
    pub svg: String,
    /// The file's contents as PNG.
    pub png: Vec<u8>,
}

impl Picture {
    /// Makes both formats of a drawing. It fails if drawing does, if the drawing has no pixels or
    /// too many, or if the frame does not fit into it.
    pub fn new(drawing: &impl Drawing) -> anyhow::Result<Self> {
        make(drawing).map_err(|error| anyhow!(error).context("the drawing failed"))
    }

    /// Returns the endings and the contents of the files.
    pub fn files(&self) -> [(&'static str, &[u8]); 2] {
        [("svg", self.svg.as_bytes()), ("png", &self.png)]
    }
}

fn make(drawing: &impl Drawing) -> Result<Picture, DrawError> {
    register_font()?;
    let (width, height) = drawing.size();
    if !(1..=MOST_PIXELS).contains(&(u64::from(width) * u64::from(height))) {
        let size = format!("{width} x {height} pixels");
        return Err(format!("a drawing cannot have {size}: choose from 1 to {MOST_PIXELS}").into());
    }
    let mut svg = String::new();
    paint(drawing, SVGBackend::with_string(&mut svg, (width, height)))?;
    let mut rgb = vec![255; 3 * width as usize * height as usize];
    paint(drawing, BitMapBackend::with_buffer(&mut rgb, (width, height)))?;
    if let Some(frame) = drawing.frame() {
        cover(&mut rgb, width as usize, &frame).ok_or("the frame is larger than the drawing")?;
        insert(&mut svg, &frame)?;
    }
    let mut png = Vec::new();
    write_png(&rgb, width, height, &mut png)?;
    Ok(Picture { svg, png })
}

/// The largest number of pixels of a drawing.
const MOST_PIXELS: u64 = 1 << 26;

/// Registers the font of PNG, which also measures the texts of SVG.
fn register_font() -> Result<(), &'static str> {
    static REGISTERED: OnceLock<Result<(), &str>> = OnceLock::new();
    *REGISTERED.get_or_init(|| {
        let regular: &[u8] = include_bytes!("../../fonts/DejaVuSans.ttf");
        let bold: &[u8] = include_bytes!("../../fonts/DejaVuSans-Bold.ttf");
        style::register_font(FONT, FontStyle::Normal, regular)
            .and_then(|()| style::register_font(FONT, FontStyle::Bold, bold))
            .map_err(|_| "the font cannot be read")
    })
}

fn paint<B: Backend>(drawing: &impl Drawing, backend: B) -> Result<(), DrawError> {
    let area = backend.into_drawing_area();
    area.fill(&WHITE)?;
    drawing.draw(&area)?;
    Ok(area.present()?)
}

/// Copies a frame into a picture; `None` if it does not fit.
fn cover(rgb: &mut [u8], width: usize, frame: &Frame<'_>) -> Option<()> {
    let len = 3 * frame.size.0 as usize;
    if frame.at.0 + frame.size.0 as usize > width {
        return None;
    }
    for (y, row) in (frame.at.1..).zip(frame.rgb.chunks_exact(len.max(1))) {
        rgb.get_mut(3 * (y * width + frame.at.0)..)?.get_mut(..len)?.copy_from_slice(row);
    }
    Some(())
}

/// Adds a frame that covers everything else of an SVG.
fn insert(svg: &mut String, frame: &Frame<'_>) -> Result<(), DrawError> {
    let mut png = Vec::new();
    write_png(frame.rgb, frame.size.0, frame.size.1, &mut png)?;
    let ((x, y), (width, height)) = (frame.at, frame.size);
    let end = svg.rfind("</svg>").ok_or("the SVG has no end")?;
    svg.insert_str(
        end,
        &format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" \
             href=\"data:image/png;base64,{}\"/>\n",
            BASE64_STANDARD.encode(png)
        ),
    );
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A drawing of this size, with a line of text.
    struct Greeting((u32, u32));

    impl Drawing for Greeting {
        fn size(&self) -> (u32, u32) {
            self.0
        }

        fn draw<B: Backend>(&self, area: &Area<B>) -> Result<(), DrawError> {
            Ok(area.draw_text("Hello", &(FONT, 20).into_font().color(&BLACK), (10, 10))?)
        }
    }

    #[test]
    fn a_drawing_has_both_formats() -> anyhow::Result<()> {
        let picture = Picture::new(&Greeting((200, 50)))?;
        assert!(picture.svg.contains("Hello") && picture.png.starts_with(b"\x89PNG"));
        Ok(())
    }

    #[test]
    fn a_drawing_without_pixels_or_with_too_many_is_refused() {
        for size in [(0, 9), (u32::MAX, u32::MAX), (1 << 14, 1 << 13)] {
            assert!(Picture::new(&Greeting(size)).is_err(), "{size:?}");
        }
    }
}
