//! The style of the pictures, and their files.

use std::path::Path;

use plotters::{
    prelude::*,
    style::text_anchor::{HPos, Pos, VPos},
};

use super::picture::{Drawing, FONT, Picture};
use crate::shared::json::replace_file;

pub const INK: RGBColor = RGBColor(33, 37, 41);
pub const FAINT: RGBColor = RGBColor(108, 117, 125);
pub const BLUE: RGBColor = RGBColor(22, 129, 196);
pub const RED: RGBColor = RGBColor(196, 30, 30);

/// The colors of curves in one picture.
pub const COLORS: [RGBColor; 6] = [
    BLUE,
    RGBColor(224, 123, 0),
    RGBColor(0, 128, 110),
    RGBColor(130, 70, 180),
    RGBColor(120, 90, 60),
    RGBColor(200, 40, 120),
];

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
    let picture = Picture::new(figure)?;
    for (ending, bytes) in picture.files() {
        let path = folder.join(format!("{name}.{ending}"));
        replace_file(&path, bytes)?;
        say!("wrote {}", path.display())?;
    }
    Ok(())
}
