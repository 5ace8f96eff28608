//! Pictures that an environment draws itself.

use base64::{Engine, prelude::BASE64_STANDARD};
use serde::Serialize;

use super::error::PageError;

/// Seconds for which the page shows a picture.
const PERIOD: f64 = 0.1;

/// The most pixels along a side that a page holds: enough to see, and about 100 kB per picture.
const MOST_SIDE: usize = 480;

/// The pictures of an episode.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Pictures {
    /// Duration of a step, in seconds.
    period: f64,
    /// The width and height of each as it was drawn.
    #[serde(skip)]
    size: [usize; 2],
    /// The pictures as data URLs of PNG images.
    pictures: Vec<String>,
}

impl Pictures {
    /// Returns no pictures yet; all must have the same width and height.
    pub(super) const fn new(size: [usize; 2]) -> Self {
        Self { period: PERIOD, size, pictures: Vec::new() }
    }

    /// Returns the pictures as data URLs.
    pub(super) fn into_urls(self) -> Vec<String> {
        self.pictures
    }

    /// Adds a frame.
    pub(super) fn push(&mut self, rgb: &[u8], size: [usize; 2]) -> Result<(), PageError> {
        let wrong = |reason| Err(PageError::Scene { reason });
        let [width, height] = size;
        if size != self.size {
            return wrong(format!(
                "a picture has the width and height {size:?}, and the first one {:?}",
                self.size
            ));
        }
        let len = width.checked_mul(height).and_then(|pixels| pixels.checked_mul(3));
        if rgb.is_empty() || len != Some(rgb.len()) {
            return wrong(format!(
                "a picture has {} bytes: pass width x height x 3, at least one pixel",
                rgb.len()
            ));
        }
        let factor = width.max(height).div_ceil(MOST_SIDE);
        let (pixels, size) = shrunk(rgb.as_chunks().0, size, factor);
        let png = png_of(pixels.as_flattened(), size)
            .map_err(|error| PageError::Scene { reason: error.to_string() })?;
        self.pictures.push(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(png)));
        Ok(())
    }
}

/// Returns a picture with the mean color of each square of `factor` by `factor` pixels, and its
/// width and height. Squares at the right and lower edge may be cut.
fn shrunk(
    pixels: &[[u8; 3]],
    [width, height]: [usize; 2],
    factor: usize,
) -> (Vec<[u8; 3]>, [usize; 2]) {
    let size = [width.div_ceil(factor), height.div_ceil(factor)];
    let mut colors = Vec::with_capacity(size[0] * size[1]);
    for rows in pixels.chunks(width * factor) {
        for left in (0..width).step_by(factor) {
            let mut sum = [0; 3];
            let mut count = 0;
            for row in rows.chunks(width) {
                for pixel in &row[left..width.min(left + factor)] {
                    for (sum, channel) in sum.iter_mut().zip(pixel) {
                        *sum += u64::from(*channel);
                    }
                    count += 1;
                }
            }
            colors.push(sum.map(|sum| ((sum + count / 2) / count) as u8));
        }
    }
    (colors, size)
}

fn png_of(rgb: &[u8], [width, height]: [usize; 2]) -> Result<Vec<u8>, png::EncodingError> {
    let mut bytes = Vec::new();
    // Both are at most `MOST_SIDE`.
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::shrunk;

    #[test]
    fn a_smaller_picture_has_the_mean_colors() {
        let pixel = |red| [red, 0, 255];
        let pixels = [10, 20, 50, 30, 40, 70].map(pixel);
        assert_eq!(shrunk(&pixels, [3, 2], 1), (pixels.to_vec(), [3, 2]));
        assert_eq!(shrunk(&pixels, [3, 2], 2), (vec![pixel(25), pixel(60)], [2, 1]));
    }
}
