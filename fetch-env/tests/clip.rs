//! Clips, read back with decoders.
#![cfg(feature = "clip")]

use std::io::Cursor;

use fetch_env::clip::{Clip, ClipError, write_png};
use proptest::prelude::*;
use testing::Result;

type Frames = Vec<Vec<u8>>;

fn clip(width: u32, height: u32, frames: &Frames) -> Clip {
    let mut clip = Clip::new(width, height).expect("a size");
    for frame in frames {
        clip.push(frame).expect("a frame");
    }
    clip
}

/// Reads the frames of an APNG as a viewer shows them.
fn read_apng(bytes: &[u8]) -> Frames {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().expect("a PNG");
    let (width, count) = (
        reader.info().width as usize,
        reader.info().animation_control().map_or(1, |control| control.num_frames),
    );
    let mut canvas = vec![0; reader.output_buffer_size().expect("a size")];
    let mut frames = Vec::new();
    for _ in 0..count {
        let mut part = vec![0; canvas.len()];
        reader.next_frame(&mut part).expect("a frame");
        let area = reader.info().frame_control().copied();
        let (x, y, w, h) = area.map_or((0, 0, width, canvas.len() / width / 3), |area| {
            let [x, y, w, h] = [area.x_offset, area.y_offset, area.width, area.height];
            (x as usize, y as usize, w as usize, h as usize)
        });
        for row in 0..h {
            let to = ((y + row) * width + x) * 3;
            canvas[to..][..3 * w].copy_from_slice(&part[3 * row * w..][..3 * w]);
        }
        frames.push(canvas.clone());
    }
    frames
}

/// Reads the frames of a GIF as a viewer shows them.
fn read_gif(bytes: &[u8]) -> Frames {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::Indexed);
    let mut reader = options.read_info(bytes).expect("a GIF");
    let palette = reader.global_palette().expect("one palette for all").to_vec();
    let width = usize::from(reader.width());
    let mut canvas = vec![0; 3 * width * usize::from(reader.height())];
    let mut frames = Vec::new();
    while let Some(frame) = reader.read_next_frame().expect("a frame") {
        assert!(frame.palette.is_none() && frame.delay == 4);
        for (at, &index) in frame.buffer.iter().enumerate() {
            let (row, column) = (at / usize::from(frame.width), at % usize::from(frame.width));
            let to = (usize::from(frame.top) + row) * width + usize::from(frame.left) + column;
            canvas[3 * to..][..3].copy_from_slice(&palette[3 * usize::from(index)..][..3]);
        }
        frames.push(canvas.clone());
    }
    frames
}

fn apng_of(clip: &Clip) -> Vec<u8> {
    let mut bytes = Vec::new();
    clip.write_apng(&mut bytes).expect("a vector takes all");
    bytes
}

fn gif_of(clip: &Clip) -> Vec<u8> {
    let mut bytes = Vec::new();
    clip.write_gif(&mut bytes).expect("a vector takes all");
    bytes
}

fn frames() -> impl Strategy<Value = (u32, u32, Frames)> {
    (1..12_u32, 1..9_u32).prop_flat_map(|(width, height)| {
        // Mostly like the frame before, as in an episode.
        let changes = prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6);
        prop::collection::vec(changes, 1..6).prop_map(move |changes| {
            let mut frame = vec![100; (3 * width * height) as usize];
            let frames = changes.into_iter().map(|changes| {
                for (index, value) in changes {
                    let at = index.index(frame.len());
                    frame[at] = value;
                }
                frame.clone()
            });
            (width, height, frames.collect())
        })
    })
}

proptest! {
    #[test]
    fn an_apng_preserves_every_pixel((width, height, frames) in frames()) {
        prop_assert_eq!(read_apng(&apng_of(&clip(width, height, &frames))), frames);
    }

    #[test]
    fn a_gif_preserves_few_colors((width, height, frames) in frames()) {
        prop_assert_eq!(read_gif(&gif_of(&clip(width, height, &frames))), frames);
    }
}

#[test]
fn many_colors_stay_close_in_a_gif_and_do_not_flicker() {
    let gradient = |shift: usize| -> Vec<u8> {
        let pixels = (0..64 * 64_usize).map(|at| (at % 64, at / 64));
        pixels
            .flat_map(|(x, y)| [4 * x as u8, 4 * y as u8, if x < 8 { shift as u8 } else { 90 }])
            .collect()
    };
    let frames: Frames = (0..4).map(|step| gradient(60 * step)).collect();
    let all_shown = read_gif(&gif_of(&clip(64, 64, &frames)));
    for (shown, frame) in all_shown.iter().zip(&frames) {
        let sum: u32 = shown.iter().zip(frame).map(|(&a, &b)| u32::from(a.abs_diff(b))).sum();
        assert!(f64::from(sum) / (frame.len() as f64) < 8.0, "{sum}");
        let still = |frame: &[u8], y: usize| frame[(64 * y + 8) * 3..64 * (y + 1) * 3].to_vec();
        assert!((0..64).all(|y| still(shown, y) == still(&all_shown[0], y)));
    }
}

#[test]
fn a_rare_striking_color_stays_exact_in_a_gif() {
    const RED: [u8; 3] = [200, 10, 10];
    // A thousand shades of gray and green, and one red pixel.
    let mut frame: Vec<u8> = (0..1000_u32)
        .flat_map(|at| [(at % 250) as u8, (at % 250) as u8 / 2 + 4 * (at / 250) as u8, 90])
        .collect();
    frame[1500..1503].copy_from_slice(&RED);
    let shown = read_gif(&gif_of(&clip(100, 10, &vec![frame])));
    assert_eq!(shown[0][1500..1503], RED);
}

#[test]
fn captions_are_written_only_in_the_corner() -> Result {
    let frame = vec![30; 240 * 100 * 3];
    let mut clip = Clip::new(240, 100)?;
    let caption = "step      12\nreward   -0.250\ndistance  0.250 m";
    clip.push_with_caption(&frame, caption)?;
    clip.push_with_caption(&frame, &caption.replace("12", "13"))?;
    let [first, second] = [0, 1].map(|index| clip.frames().nth(index).expect("a frame").to_vec());
    let white = first.iter().filter(|&&value| value == 255).count();
    assert!(white > 300, "{white}");
    assert_ne!(first, second, "the step is written");
    for (at, value) in first.chunks_exact(3).enumerate() {
        assert!(value[0] == 30 || (at % 240 < 150 && at / 240 < 40), "pixel {at}");
    }
    // Only part of the text fits.
    Clip::new(3, 2)?.push_with_caption(&[0; 18], caption)?;
    Ok(())
}

#[test]
fn invalid_clips_are_refused() -> Result {
    assert!(matches!(Clip::new(0, 3), Err(ClipError::Size { width: 0, height: 3 })));
    assert!(matches!(Clip::new(65536, 3), Err(ClipError::Size { .. })));
    let mut clip = Clip::new(2, 2)?;
    let error = clip.push(&[0; 11]).unwrap_err();
    assert!(matches!(error, ClipError::FrameLength { expected: 12, actual: 11 }));
    assert!(matches!(clip.write_gif(Vec::new()), Err(ClipError::NoFrames)));
    assert!(matches!(clip.write_apng(Vec::new()), Err(ClipError::NoFrames)));
    clip.push(&[0; 12])?;
    let full: &mut [u8] = &mut [0; 10];
    assert!(matches!(clip.write_gif(full), Err(ClipError::Io(_))));
    let full: &mut [u8] = &mut [0; 10];
    assert!(matches!(clip.write_apng(full), Err(ClipError::Io(_))));
    Ok(())
}

#[test]
fn a_still_is_a_plain_png() -> Result {
    let rgb: Vec<u8> = (0..24).collect();
    let mut bytes = Vec::new();
    write_png(&rgb, 4, 2, &mut bytes)?;
    assert_eq!(read_apng(&bytes), [rgb]);
    assert!(!bytes.windows(4).any(|window| window == b"acTL"));
    Ok(())
}
