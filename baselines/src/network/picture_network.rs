//! Networks that see a picture.

use std::fmt;

use rand::Rng;

use super::perceptron::draw_layer;
use super::picture_shape::PictureShape;
use super::vectors::follow;

/// A network that sees a picture and numbers. Its outputs have no bounds.
///
/// Pictures are bytes of `height x width x 3`, as [`Pixels`](fetch_env::Pixels) are. The network
/// subtracts a mean picture and multiplies by one scale, which [`measure`](Self::measure) sets.
///
/// All parameters lie in one vector, as their gradient does: for each convolution a row of weights
/// for each number that it sees (by row of pixels, pixel and channel) and, except for the last
/// one, biases; then weights and biases of each layer of the perceptron, with a row for each input.
#[derive(Clone, PartialEq)]
pub struct PictureNetwork {
    pub(super) shape: PictureShape,
    parameters: Vec<f32>,
    /// The mean picture, and then the scale.
    pixels: Vec<f32>,
}

impl fmt::Debug for PictureNetwork {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PictureNetwork").field("shape", &self.shape).finish_non_exhaustive()
    }
}

impl PictureNetwork {
    /// Draws weights and biases as [`Network::init`](super::Network::init) does. The mean picture is
    /// gray.
    #[must_use]
    pub fn init(shape: PictureShape, rng: &mut impl Rng) -> Self {
        let mut parameters = vec![0.0; shape.num_parameters()];
        for layer in &shape.layers {
            draw_layer(1.0, layer.grid.window_len(), rng, layer.of_mut(&mut parameters));
        }
        shape.head.init(1.0, rng, &mut parameters[shape.head_start()..]);
        let mut pixels = vec![127.5; shape.picture_len()];
        pixels.push(1.0 / 64.0);
        Self { shape, parameters, pixels }
    }

    /// Returns a network with these [vectors](Self::vectors), as long as the shape needs.
    #[cfg(feature = "render")]
    pub(crate) const fn from_vectors(
        shape: PictureShape,
        parameters: Vec<f32>,
        pixels: Vec<f32>,
    ) -> Self {
        Self { shape, parameters, pixels }
    }

    /// Returns the parameters, and the mean picture with the scale.
    #[cfg(feature = "render")]
    pub(crate) fn vectors(&self) -> [&[f32]; 2] {
        [&self.parameters, &self.pixels]
    }

    /// Sets the mean picture to that of some pictures, and the scale to one over the standard
    /// deviation of their bytes from it, or to 1 if that is less than 1. Without a picture, nothing
    /// changes.
    ///
    /// # Panics
    /// Panics if `pictures` is not a number of whole pictures.
    pub fn measure(&mut self, pictures: &[u8]) {
        let len = self.shape.picture_len();
        let count = pictures.len() / len;
        assert_eq!(pictures.len(), count * len);
        if count == 0 {
            return;
        }
        // Sums of bytes and of their squares are whole numbers, so that no order changes them.
        let (mut sums, mut squares) = (vec![0_u64; len], 0_u64);
        for picture in pictures.chunks_exact(len) {
            for (sum, byte) in sums.iter_mut().zip(picture) {
                *sum += u64::from(*byte);
                squares += u64::from(*byte).pow(2);
            }
        }
        let means = sums.iter().map(|sum| *sum as f64 / count as f64);
        let of_means: f64 = means.clone().map(|mean| mean * mean).sum();
        let variance = (squares as f64 / count as f64 - of_means) / len as f64;
        self.pixels.clear();
        self.pixels.extend(means.map(|mean| mean as f32));
        self.pixels.push((1.0 / variance.max(1.0).sqrt()) as f32);
    }

    /// Returns the shape.
    #[must_use]
    pub const fn shape(&self) -> &PictureShape {
        &self.shape
    }

    /// Returns the parameters.
    #[must_use]
    pub fn parameters(&self) -> &[f32] {
        &self.parameters
    }

    /// Returns the parameters, for [`Adam::step`](super::Adam::step).
    pub fn parameters_mut(&mut self) -> &mut [f32] {
        &mut self.parameters
    }

    /// Returns the mean picture, in bytes, and the scale.
    #[must_use]
    pub fn mean_and_scale(&self) -> (&[f32], f32) {
        let (mean, scale) = self.pixels.split_at(self.shape.picture_len());
        (mean, scale[0])
    }

    /// Moves the parameters a fraction of the way towards those of another network of the same
    /// shape, and takes over its mean picture and scale.
    pub fn follow(&mut self, other: &Self, fraction: f32) {
        follow(&mut self.parameters, &other.parameters, fraction);
        self.pixels.clone_from(&other.pixels);
    }

    /// Returns the parameters, and the mean picture with the scale, each with its name, for
    /// [`StateMut::push`](crate::learn::StateMut::push).
    pub fn vectors_mut(&mut self) -> [(&'static str, &mut Vec<f32>); 2] {
        let Self { parameters, pixels, .. } = self;
        [("parameters", parameters), ("pixels", pixels)]
    }
}
