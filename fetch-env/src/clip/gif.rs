use std::{borrow::Cow, cmp::Reverse, collections::HashMap, io::Write};

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, Frame, Repeat};

use super::{Clip, ClipError, FRAME_DELAY, changes::Rectangle};

type Rgb = [u8; 3];

pub(super) fn write(clip: &Clip, out: impl Write) -> Result<(), ClipError> {
    let [first, later @ ..] = clip.frames.as_slice() else { return Err(ClipError::NoFrames) };
    let palette = Palette::new(&clip.frames);
    let mut encoder = Encoder::new(out, clip.width, clip.height, &palette.colours)?;
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

/// The colours of a clip, and which of them stands for each colour of its frames.
struct Palette {
    /// Red, green and blue of up to 256 colours.
    colours: Vec<u8>,
    index: HashMap<Rgb, u8>,
}

/// How many of the most common colours stay exactly as they are: the sky, the floor, the table.
const EXACT: usize = 64;
/// The network is shown every n-th colour: 1 is best, 30 fastest.
const SAMPLE_FACTOR: i32 = 3;

impl Palette {
    fn new(frames: &[Vec<u8>]) -> Self {
        let mut counts: HashMap<Rgb, usize> = HashMap::new();
        for &colour in frames.iter().flat_map(|frame| frame.as_chunks::<3>().0) {
            *counts.entry(colour).or_default() += 1;
        }
        let mut ranked: Vec<(Rgb, usize)> = counts.into_iter().collect();
        ranked.sort_unstable_by_key(|&(colour, count)| (Reverse(count), colour));
        let exact = if ranked.len() > 256 { EXACT } else { ranked.len() };
        let rare = ranked.split_off(exact);
        let mut colours: Vec<u8> = ranked.iter().flat_map(|(colour, _)| *colour).collect();
        let mut index: HashMap<Rgb, u8> =
            ranked.into_iter().zip(0..=255).map(|((colour, _), index)| (colour, index)).collect();
        if !rare.is_empty() {
            let network = network(&rare, 256 - exact);
            colours.extend(network.color_map_rgb());
            index.extend(rare.into_iter().map(|(colour, _)| {
                let [red, green, blue] = colour;
                (colour, (exact + network.index_of(&[red, green, blue, 255])) as u8)
            }));
        }
        Self { colours, index }
    }

    /// The palette's colour of every pixel.
    fn indices(&self, frame: &[u8]) -> Vec<u8> {
        frame.as_chunks::<3>().0.iter().map(|colour| self.index[colour]).collect()
    }
}

/// Chooses `count` colours for all these. Common ones are shown to the network more often, but not
/// as much as they are more common.
fn network(colours: &[(Rgb, usize)], count: usize) -> NeuQuant {
    let mut samples = Vec::new();
    for &([red, green, blue], count) in colours {
        for _ in 0..=count.ilog2() {
            samples.extend([red, green, blue, 255]);
        }
    }
    NeuQuant::new(SAMPLE_FACTOR, count, &samples)
}
