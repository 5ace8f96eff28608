//! The spatial softmax, which turns each channel of a picture into the point where it is active.
//!
//! Source: Levine et al., *End-to-end training of deep visuomotor policies*, 2016.

use std::f32::consts::LOG2_E;

use super::pass::larger;
use super::vectors::vectorize;

/// Where the rows and columns of a picture's pixels are, from -1 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pixels {
    pub(super) height: usize,
    pub(super) width: usize,
}

impl Pixels {
    /// Returns the x and y of each pixel.
    #[inline(always)]
    fn places(self) -> impl Iterator<Item = [f32; 2]> {
        let place = |at: usize, len: usize| (2 * at) as f32 / (len.max(2) - 1) as f32 - 1.0;
        let Self { height, width } = self;
        (0..height * width).map(move |at| [place(at % width, width), place(at / width, height)])
    }
}

/// Turns the channels of one picture, a row for each pixel, into their shares of the pixels, and
/// writes the mean x of each channel, and then the mean y of each, to `points`. `scratch` is memory.
pub(super) fn forward(
    pixels: Pixels,
    channels: &mut [f32],
    points: &mut [f32],
    scratch: &mut Vec<f32>,
) {
    let num_channels = points.len() / 2;
    scratch.clear();
    scratch.resize(2 * num_channels, 0.0);
    let (largest, sums) = scratch.split_at_mut(num_channels);
    largest.fill(f32::NEG_INFINITY);
    points.fill(0.0);
    let (xs, ys) = points.split_at_mut(num_channels);
    vectorize(
        #[inline(always)]
        || {
            for row in channels.chunks_exact(num_channels) {
                let pairs = largest.iter_mut().zip(row);
                pairs.for_each(|(largest, value)| *largest = larger(*value, *largest));
            }
            for row in channels.chunks_exact_mut(num_channels) {
                for ((value, largest), sum) in row.iter_mut().zip(&*largest).zip(&mut *sums) {
                    *value = exp_of_negative(*value - largest);
                    *sum += *value;
                }
            }
            sums.iter_mut().for_each(|sum| *sum = 1.0 / *sum);
            for (row, [x, y]) in channels.chunks_exact_mut(num_channels).zip(pixels.places()) {
                let means = xs.iter_mut().zip(&mut *ys);
                for ((share, sum), (mean_x, mean_y)) in row.iter_mut().zip(&*sums).zip(means) {
                    *share *= sum;
                    *mean_x += *share * x;
                    *mean_y += *share * y;
                }
            }
        },
    );
}

/// Writes the gradient of the channels, given their shares, their points and the points' gradient.
pub(super) fn backward(
    pixels: Pixels,
    shares: &[f32],
    points: &[f32],
    by_points: &[f32],
    gradient: &mut [f32],
) {
    let num_channels = points.len() / 2;
    let ((xs, ys), (by_xs, by_ys)) =
        (points.split_at(num_channels), by_points.split_at(num_channels));
    vectorize(
        #[inline(always)]
        || {
            let rows = shares.chunks_exact(num_channels).zip(pixels.places());
            for (gradient, (shares, [x, y])) in gradient.chunks_exact_mut(num_channels).zip(rows) {
                let means = xs.iter().zip(ys);
                let slopes = by_xs.iter().zip(by_ys);
                let columns = shares.iter().zip(means.zip(slopes));
                for (gradient, (share, ((mean_x, mean_y), (by_x, by_y)))) in
                    gradient.iter_mut().zip(columns)
                {
                    *gradient = share * ((x - mean_x) * by_x + (y - mean_y) * by_y);
                }
            }
        },
    );
}

/// Returns the exponential function of a number that is at most 0, or of -87 for smaller ones, which
/// is 1.6e-38. It is made of operations that have vectors and the same bits on each processor.
///
/// Source: Cody and Waite, *Software manual for the elementary functions*, 1980, with a Taylor
/// polynomial.
#[inline(always)]
fn exp_of_negative(value: f32) -> f32 {
    /// The logarithm of 2 in two parts. Products of the first with whole numbers are exact.
    const LN_2: [f32; 2] = [0.693_359_4, -2.121_944_4e-4];
    /// Added to a number, it rounds it, and the low bits are the whole number.
    const ROUND: f32 = 12_582_912.0;
    let value = larger(value, -87.0);
    let rounded = value * LOG2_E + ROUND;
    let whole = rounded - ROUND;
    let rest = value - whole * LN_2[0] - whole * LN_2[1];
    let coefficients = [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0];
    let power = coefficients.iter().fold(1.0 / 720.0, |sum, term| sum * rest + term);
    // Adds the whole number to the exponent.
    f32::from_bits(power.to_bits().wrapping_add(rounded.to_bits() << 23))
}

#[cfg(test)]
mod tests {
    use super::exp_of_negative;

    #[test]
    fn exponentials_are_exact_to_three_last_bits() {
        for value in (0..=870_000).map(|number| -1e-4 * number as f32) {
            let exact = f64::from(value).exp();
            let error = f64::from(exp_of_negative(value)) / exact - 1.0;
            assert!(error.abs() < 3.0 * f64::from(f32::EPSILON), "{value}: {error}");
        }
        assert_eq!(exp_of_negative(0.0), 1.0);
        assert_eq!(exp_of_negative(f32::NEG_INFINITY), exp_of_negative(-87.0));
    }
}
