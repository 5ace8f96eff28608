use std::io::Write;

use super::{Clip, ClipError, FRAME_DELAY, changes::Rectangle};

pub(super) fn write(clip: &Clip, out: impl Write) -> Result<(), ClipError> {
    let [first, later @ ..] = clip.frames.as_slice() else { return Err(ClipError::NoFrames) };
    let (width, height) = (u32::from(clip.width), u32::from(clip.height));
    let mut encoder = png::Encoder::new(out, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    if !later.is_empty() {
        encoder.set_animated(clip.frames.len() as u32, 0)?;
        encoder.set_frame_delay(FRAME_DELAY, 100)?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(first)?;
    let mut before = first;
    for frame in later {
        let (pixels, _) = frame.as_chunks::<3>();
        let changes =
            Rectangle::of_changes(before.as_chunks::<3>().0, pixels, usize::from(clip.width));
        writer.reset_frame_position()?; // or the new size would be checked at the old place
        writer.set_frame_dimension(changes.x.len() as u32, changes.y.len() as u32)?;
        writer.set_frame_position(changes.x.start as u32, changes.y.start as u32)?;
        let part: Vec<[u8; 3]> = changes.cut(pixels, usize::from(clip.width)).collect();
        writer.write_image_data(part.as_flattened())?;
        before = frame;
    }
    Ok(writer.finish()?)
}
