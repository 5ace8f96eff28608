//! The file formats of a clip: GIF and animated PNG.

use std::{borrow::Cow, cmp::Reverse, collections::HashMap, io::Write, ops::Range};

use gif::{DisposalMethod, Frame, Repeat};

use super::error::ClipError;

/// Hundredths of a second for which a frame is shown: a control step.
const FRAME_DELAY: u16 = 4;

/// Writes an animated PNG, or a plain one for a single frame. After the first frame only changes
/// are written.
pub(super) fn write_apng(
    frames: &[Vec<u8>],
    [width, height]: [u16; 2],
    out: impl Write,
) -> Result<(), ClipError> {
    let [first, later @ ..] = frames else { return Err(ClipError::NoFrames) };
    let mut encoder = png::Encoder::new(out, width.into(), height.into());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    if !later.is_empty() {
        encoder.set_animated(frames.len() as u32, 0)?;
        encoder.set_frame_delay(FRAME_DELAY, 100)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(first)?;
    let mut before = first;
    for frame in later {
        let (pixels, _) = frame.as_chunks::<3>();
        let changes = Rectangle::of_changes(before.as_chunks::<3>().0, pixels, width.into());
        // Otherwise the new size would be checked at the old position.
        writer.reset_frame_position()?;
        writer.set_frame_dimension(changes.x.len() as u32, changes.y.len() as u32)?;
        writer.set_frame_position(changes.x.start as u32, changes.y.start as u32)?;
        let part: Vec<[u8; 3]> = changes.cut(pixels, width.into()).collect();
        writer.write_image_data(part.as_flattened())?;
        before = frame;
    }
    Ok(writer.finish()?)
}

/// Writes a GIF. After the first frame only changes are written.
pub(super) fn write_gif(
    frames: &[Vec<u8>],
    [width, height]: [u16; 2],
    out: impl Write,
) -> Result<(), ClipError> {
    let [first, later @ ..] = frames else { return Err(ClipError::NoFrames) };
    let palette = Palette::new(frames);
    let mut encoder = gif::Encoder::new(out, width, height, &palette.colors)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let (width, height) = (usize::from(width), usize::from(height));
    let mut before = palette.indices(first);
    let whole = Rectangle { x: 0..width, y: 0..height };
    write_frame(&mut encoder, &whole, &before, width)?;
    for frame in later {
        let indices = palette.indices(frame);
        let changes = Rectangle::of_changes(&before, &indices, width);
        write_frame(&mut encoder, &changes, &indices, width)?;
        before = indices;
    }
    encoder.into_inner()?; // writes the trailer, whose errors a drop would hide
    Ok(())
}

fn write_frame(
    encoder: &mut gif::Encoder<impl Write>,
    part: &Rectangle,
    indices: &[u8],
    width: usize,
) -> Result<(), ClipError> {
    let buffer: Vec<u8> = part.cut(indices, width).collect();
    encoder.write_frame(&Frame {
        delay: FRAME_DELAY,
        dispose: DisposalMethod::Keep,
        left: part.x.start as u16,
        top: part.y.start as u16,
        width: part.x.len() as u16,
        height: part.y.len() as u16,
        buffer: Cow::Owned(buffer),
        ..Frame::default()
    })?;
    Ok(())
}

type Rgb = [u8; 3];

/// The colors of a GIF, and the one that represents each color of the frames.
struct Palette {
    /// Red, green and blue of up to 256 colors.
    colors: Vec<u8>,
    index: HashMap<Rgb, u8>,
}

/// Largest number of colors of a GIF.
const MOST: usize = 256;
/// Number of the most common colors that stay exact: those of the sky, the floor, the table.
const EXACT: usize = 64;

impl Palette {
    /// Chooses the most common colors, and then repeatedly the color farthest from all chosen ones:
    /// rare but striking things, such as the goal, keep their color.
    fn new(frames: &[Vec<u8>]) -> Self {
        let mut counts: HashMap<Rgb, usize> = HashMap::new();
        for &color in frames.iter().flat_map(|frame| frame.as_chunks::<3>().0) {
            *counts.entry(color).or_default() += 1;
        }
        let mut ranked: Vec<(Rgb, usize)> = counts.into_iter().collect();
        ranked.sort_unstable_by_key(|&(color, count)| (Reverse(count), color));
        let mut chosen: Vec<Rgb> = Vec::new();
        // For each color, the distance and index of the nearest chosen one.
        let mut nearest = vec![(u32::MAX, 0); ranked.len()];
        while chosen.len() < MOST.min(ranked.len()) {
            let at = if chosen.len() < EXACT {
                chosen.len()
            } else {
                (0..ranked.len()).max_by_key(|&at| (nearest[at].0, Reverse(at))).unwrap_or(0)
            };
            let (color, _) = ranked[at];
            for ((other, _), nearest) in ranked.iter().zip(&mut nearest) {
                *nearest = (*nearest).min((distance(color, *other), chosen.len()));
            }
            chosen.push(color);
        }
        let index =
            ranked.iter().zip(nearest).map(|(&(color, _), (_, at))| (color, at as u8)).collect();
        Self { colors: chosen.concat(), index }
    }

    /// Returns the palette's color of every pixel.
    fn indices(&self, frame: &[u8]) -> Vec<u8> {
        frame.as_chunks::<3>().0.iter().map(|color| self.index[color]).collect()
    }
}

/// Returns the squared distance between two colors.
fn distance(a: Rgb, b: Rgb) -> u32 {
    a.into_iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}

/// The part of a frame that differs from the previous one, in pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Rectangle {
    x: Range<usize>,
    y: Range<usize>,
}

impl Rectangle {
    /// Returns the smallest rectangle with all pixels in which two pictures of `width` differ; one
    /// pixel if none differ, because a frame must have some.
    fn of_changes<T: PartialEq>(before: &[T], after: &[T], width: usize) -> Self {
        let rows = || before.chunks_exact(width).zip(after.chunks_exact(width)).enumerate();
        let mut changed = rows().filter(|(_, (before, after))| before != after).map(|(y, _)| y);
        let Some(top) = changed.next() else { return Self { x: 0..1, y: 0..1 } };
        let y = top..changed.last().unwrap_or(top) + 1;
        let mut x = width..0;
        for (_, (before, after)) in rows().take(y.end).skip(y.start) {
            let differs = |&column: &usize| before[column] != after[column];
            x.start = (0..x.start).find(differs).unwrap_or(x.start);
            x.end = (x.end..width).rfind(differs).map_or(x.end, |column| column + 1);
        }
        Self { x, y }
    }

    /// Iterates over the pixels of a picture of `width` within the rectangle, row by row.
    fn cut<'a, T: Copy>(&'a self, picture: &'a [T], width: usize) -> impl Iterator<Item = T> + 'a {
        let rows = picture.chunks_exact(width).skip(self.y.start).take(self.y.len());
        rows.flat_map(|row| row[self.x.clone()].iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::Rectangle;

    #[test]
    fn the_rectangle_holds_all_changes_and_no_more() {
        let before = [0; 20];
        let mut after = before;
        assert_eq!(Rectangle::of_changes(&before, &after, 5), Rectangle { x: 0..1, y: 0..1 });
        after[7] = 1; // row 1, column 2
        assert_eq!(Rectangle::of_changes(&before, &after, 5), Rectangle { x: 2..3, y: 1..2 });
        after[16] = 2; // row 3, column 1
        after[13] = 3; // row 2, column 3
        let changes = Rectangle::of_changes(&before, &after, 5);
        assert_eq!(changes, Rectangle { x: 1..4, y: 1..4 });
        assert_eq!(changes.cut(&after, 5).collect::<Vec<_>>(), [0, 1, 0, 0, 0, 3, 2, 0, 0]);
    }
}
