//! A drawing, written both as PNG and as SVG.

use std::{fs, path::Path};

use anyhow::{Context, anyhow};
use base64::{Engine, prelude::BASE64_STANDARD};
use fetch_env::clip::write_png;
use plotters::{
    coord::Shift,
    prelude::*,
    style::{
        self,
        text_anchor::{HPos, Pos, VPos},
    },
};

pub type Area<B> = DrawingArea<B, Shift>;

/// Any of plotters' backends.
pub trait Backend: DrawingBackend<ErrorType: 'static> {}

impl<B: DrawingBackend<ErrorType: 'static>> Backend for B {}

/// A drawing by plotters, on any backend.
pub trait Drawing {
    fn size(&self) -> (u32, u32);

    fn draw<B: Backend>(&self, area: &Area<B>) -> anyhow::Result<()>;

    /// Returns a picture that covers them.
    fn frame(&self) -> Option<Frame<'_>> {
        None
    }
}

/// A rendered picture, and the place of its upper left corner.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    pub at: (usize, usize),
    pub size: (u32, u32),
    pub rgb: &'a [u8],
}

/// The font of all texts, which measures them and draws them in PNG; an SVG's viewer has its own.
pub const FONT: &str = "sans-serif";
pub const INK: RGBColor = RGBColor(33, 37, 41);
pub const FAINT: RGBColor = RGBColor(108, 117, 125);
pub const BLUE: RGBColor = RGBColor(22, 129, 196);
pub const RED: RGBColor = RGBColor(196, 30, 30);

/// Registers the font; to be called before anything is drawn.
pub fn register_font() -> anyhow::Result<()> {
    for (look, bytes) in
        [(FontStyle::Normal, dejavu::sans::regular()), (FontStyle::Bold, dejavu::sans::bold())]
    {
        let unreadable = |_| anyhow!("the font cannot be read");
        style::register_font(FONT, look, bytes).map_err(unreadable)?;
    }
    Ok(())
}

/// Returns the style of a text that is anchored in the middle of its left edge.
pub fn text(size: u32, color: RGBColor) -> TextStyle<'static> {
    (FONT, size).into_font().color(&color).pos(Pos::new(HPos::Left, VPos::Center))
}

/// Returns the style of a text that is centered on its anchor.
pub fn centered(size: u32, color: RGBColor) -> TextStyle<'static> {
    text(size, color).pos(Pos::new(HPos::Center, VPos::Center))
}

/// Returns the bold style of [`text`].
pub fn bold(size: u32) -> TextStyle<'static> {
    let font = (FONT, size, FontStyle::Bold).into_font();
    font.color(&INK).pos(Pos::new(HPos::Left, VPos::Center))
}

/// Writes `NAME.svg` and `NAME.png` into a folder.
pub fn save(figure: &impl Drawing, folder: &Path, name: &str) -> anyhow::Result<()> {
    let (width, height) = figure.size();
    let mut svg = String::new();
    paint(figure, SVGBackend::with_string(&mut svg, (width, height)))?;
    let mut rgb = vec![255; 3 * width as usize * height as usize];
    paint(figure, BitMapBackend::with_buffer(&mut rgb, (width, height)))?;
    if let Some(frame) = figure.frame() {
        insert(&mut svg, &frame)?;
        let rows = frame.rgb.chunks_exact(3 * frame.size.0 as usize);
        for (y, row) in (frame.at.1..).zip(rows) {
            rgb[3 * (y * width as usize + frame.at.0)..][..row.len()].copy_from_slice(row);
        }
    }
    let mut png = Vec::new();
    write_png(&rgb, width, height, &mut png)?;
    for (ending, bytes) in [("svg", svg.into_bytes()), ("png", png)] {
        let path = folder.join(format!("{name}.{ending}"));
        fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        println!("wrote {}", path.display());
    }
    Ok(())
}

fn paint<B: Backend>(figure: &impl Drawing, backend: B) -> anyhow::Result<()> {
    let area = backend.into_drawing_area();
    area.fill(&WHITE)?;
    figure.draw(&area)?;
    Ok(area.present()?)
}

/// Adds a frame that covers everything else of an SVG.
fn insert(svg: &mut String, frame: &Frame<'_>) -> anyhow::Result<()> {
    let mut png = Vec::new();
    write_png(frame.rgb, frame.size.0, frame.size.1, &mut png)?;
    let ((x, y), (width, height)) = (frame.at, frame.size);
    let end = svg.rfind("</svg>").context("an SVG has an end")?;
    svg.insert_str(
        end,
        &format!(
            "<image x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" href=\"data:image/png;base64,{}\"/>\n",
            BASE64_STANDARD.encode(png)
        ),
    );
    Ok(())
}
