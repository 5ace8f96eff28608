use std::{borrow::Cow, collections::HashMap, io::Write};

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

/// The network is shown every n-th colour: 1 is best, 30 fastest.
const SAMPLE_FACTOR: i32 = 3;

impl Palette {
    fn new(frames: &[Vec<u8>]) -> Self {
        let mut counts: HashMap<Rgb, usize> = HashMap::new();
        for &colour in frames.iter().flat_map(|frame| frame.as_chunks::<3>().0) {
            *counts.entry(colour).or_default() += 1;
        }
        let mut distinct: Vec<(Rgb, usize)> = counts.into_iter().collect();
        distinct.sort_unstable();
        if distinct.len() <= 256 {
            let colours = distinct.iter().flat_map(|(colour, _)| *colour).collect();
            let index = (0..=255).zip(distinct).map(|(index, (colour, _))| (colour, index));
            return Self { colours, index: index.collect() };
        }
        // Common colours are shown more often, but not as much as they are more common: the sky
        // would leave nothing for the robot.
        let mut samples = Vec::new();
        for (rgb, count) in &distinct {
            for _ in 0..=count.ilog2() {
                samples.extend([rgb[0], rgb[1], rgb[2], 255]);
            }
        }
        let network = NeuQuant::new(SAMPLE_FACTOR, 256, &samples);
        let index = distinct.into_iter().map(|(colour, _)| {
            let [red, green, blue] = colour;
            (colour, network.index_of(&[red, green, blue, 255]) as u8)
        });
        Self { index: index.collect(), colours: network.color_map_rgb() }
    }

    /// The palette's colour of every pixel.
    fn indices(&self, frame: &[u8]) -> Vec<u8> {
        frame.as_chunks::<3>().0.iter().map(|colour| self.index[colour]).collect()
    }
}
