use std::{borrow::Cow, cmp::Reverse, collections::HashMap, io::Write};

use gif::{DisposalMethod, Encoder, Frame, Repeat};

use super::{Clip, ClipError, FRAME_DELAY, changes::Rectangle};

type Rgb = [u8; 3];

pub(super) fn write(clip: &Clip, out: impl Write) -> Result<(), ClipError> {
    let [first, later @ ..] = clip.frames.as_slice() else { return Err(ClipError::NoFrames) };
    let palette = Palette::new(&clip.frames);
    let mut encoder = Encoder::new(out, clip.width, clip.height, &palette.colors)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let width = usize::from(clip.width);
    let mut before = palette.indices(first);
    let whole = Rectangle { x: 0..width, y: 0..usize::from(clip.height) };
    write_frame(&mut encoder, &whole, &before, width)?;
    for frame in later {
        let indices = palette.indices(frame);
        let changes = Rectangle::of_changes(&before, &indices, width);
        write_frame(&mut encoder, &changes, &indices, width)?;
        before = indices;
    }
    encoder.into_inner()?; // the trailer, which would be written without a word otherwise
    Ok(())
}

fn write_frame(
    encoder: &mut Encoder<impl Write>,
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

/// The colors of a clip, and which of them stands for each color of its frames.
struct Palette {
    /// Red, green and blue of up to 256 colors.
    colors: Vec<u8>,
    index: HashMap<Rgb, u8>,
}

/// How many colors a GIF can have.
const MOST: usize = 256;
/// How many of the most common colors stay exactly as they are: the sky, the floor, the table.
const EXACT: usize = 64;

impl Palette {
    /// The most common colors, and then always the one that is least like all chosen before: what
    /// is rare but striking, such as the goal, keeps its color.
    fn new(frames: &[Vec<u8>]) -> Self {
        let mut counts: HashMap<Rgb, usize> = HashMap::new();
        for &color in frames.iter().flat_map(|frame| frame.as_chunks::<3>().0) {
            *counts.entry(color).or_default() += 1;
        }
        let mut ranked: Vec<(Rgb, usize)> = counts.into_iter().collect();
        ranked.sort_unstable_by_key(|&(color, count)| (Reverse(count), color));
        let mut chosen: Vec<Rgb> = Vec::new();
        // For each color, how far the nearest chosen one is, and which.
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

    /// The palette's color of every pixel.
    fn indices(&self, frame: &[u8]) -> Vec<u8> {
        frame.as_chunks::<3>().0.iter().map(|color| self.index[color]).collect()
    }
}

/// The square of the distance of two colors.
fn distance(a: Rgb, b: Rgb) -> u32 {
    a.into_iter().zip(b).map(|(a, b)| u32::from(a.abs_diff(b)).pow(2)).sum()
}
