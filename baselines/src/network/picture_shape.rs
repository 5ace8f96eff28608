//! The shapes of networks that see a picture: convolutions, a spatial softmax and a perceptron.

use serde::{Deserialize, Serialize};

use super::perceptron::Shape;
use super::vectors::{parts, parts_mut};
use super::windows::Grid;

/// A layer of square convolutions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Convolution {
    /// The number of channels that it computes.
    pub channels: usize,
    /// The side of the square of pixels that it sees.
    pub kernel: usize,
    /// The pixels from one such square to the next.
    pub stride: usize,
    /// The zeros around the picture, in pixels: fewer than `kernel`.
    pub padding: usize,
}

impl Convolution {
    /// Returns three layers of 32 channels: 5 x 5 pixels with a stride of 4, and twice 3 x 3. Of a
    /// picture of 64 x 64 pixels, they make one of 11 x 11. Only pictures with a side below 48 get
    /// padding, without which little would be left of them.
    #[must_use]
    pub fn defaults([height, width]: [usize; 2]) -> [Self; 3] {
        let padding = usize::from(height.min(width) < 48);
        [
            Self { channels: 32, kernel: 5, stride: 4, padding: 2 * padding },
            Self { channels: 32, kernel: 3, stride: 1, padding },
            Self { channels: 32, kernel: 3, stride: 1, padding },
        ]
    }
}

/// Error returned when a [`PictureShape`] is impossible.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PictureShapeError {
    /// A number is too small or too large.
    #[error("{what} is {actual}: choose from {least} to {most}")]
    Range {
        /// The number.
        what: &'static str,
        /// Its value.
        actual: usize,
        /// The least value.
        least: usize,
        /// The largest value.
        most: usize,
    },
    /// A convolution does not fit the picture that it gets.
    #[error(
        "convolution {number} sees {kernel} x {kernel} pixels with {padding} pixels of padding, and \
         gets a picture of {height} x {width}: choose a kernel that is larger than the padding, and \
         not larger than the padded picture"
    )]
    Kernel {
        /// Its place, counted from 0.
        number: usize,
        /// Its kernel.
        kernel: usize,
        /// Its padding.
        padding: usize,
        /// The height of the picture that it gets.
        height: usize,
        /// Its width.
        width: usize,
    },
}

debug_as_display!(PictureShapeError);

/// The shape of a [`PictureNetwork`](super::PictureNetwork).
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureShape {
    pub(super) layers: Vec<ConvolutionLayer>,
    /// The perceptron's, whose inputs are numbers and the points of the softmax.
    pub(super) head: Shape,
}

/// A convolution, and where its parameters are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ConvolutionLayer {
    pub(super) convolution: Convolution,
    /// The picture that it gets, with padding.
    pub(super) grid: Grid,
    /// Whether it has biases and rectified linear units, which the last one has not: the softmax
    /// is the same for any bias.
    pub(super) has_biases: bool,
    /// Where its weights start, a row for each number of a window; its biases follow.
    start: usize,
}

impl ConvolutionLayer {
    /// Returns the numbers of weights and biases.
    const fn lens(&self) -> [usize; 2] {
        let channels = self.convolution.channels;
        let num_biases = if self.has_biases { channels } else { 0 };
        [self.grid.window_len() * channels, num_biases]
    }

    /// Returns weights and biases among all parameters.
    pub(super) fn of<'a>(&self, parameters: &'a [f32]) -> [&'a [f32]; 2] {
        parts(&parameters[self.start..], self.lens())
    }

    /// Returns weights and biases among all parameters, or their gradient.
    pub(super) fn of_mut<'a>(&self, parameters: &'a mut [f32]) -> [&'a mut [f32]; 2] {
        parts_mut(&mut parameters[self.start..], self.lens())
    }

    /// Returns the number of numbers that it computes of a picture.
    pub(super) const fn output_len(&self) -> usize {
        let [rows, columns] = self.grid.windows();
        rows * columns * self.convolution.channels
    }

    /// Returns the length of a row of pixels without padding.
    pub(super) const fn inner_row_len(&self) -> usize {
        (self.grid.width - 2 * self.convolution.padding) * self.grid.channels
    }

    /// Returns the windows in which each pixel of the input without padding sees the outputs that
    /// depend on it, of a picture of these outputs with the layer's stride and zeros between them.
    pub(super) const fn back(&self) -> Grid {
        let Convolution { channels, kernel, padding, .. } = self.convolution;
        let [height, width] = [self.grid.height, self.grid.width];
        Grid {
            height: height - 2 * padding + kernel - 1,
            width: width - 2 * padding + kernel - 1,
            channels,
            kernel,
            stride: 1,
        }
    }
}

/// The largest side, number of channels and length of a layer.
pub(crate) const LARGEST: usize = 1 << 14;

/// The largest number of parameters, and of the numbers of a layer for one picture.
const LIMIT: usize = 1 << 28;

impl PictureShape {
    /// Describes a network for RGB pictures of `height` x `width` pixels: convolutions with rectified
    /// linear units after all but the last, a spatial softmax, which reduces each channel to a
    /// point, and a perceptron of these hidden lengths, whose inputs are `numbers` and the points.
    /// The spatial softmax is that of Levine et al., *End-to-end training of deep visuomotor
    /// policies*, 2016.
    ///
    /// # Errors
    /// [`PictureShapeError`] if there is no convolution, a convolution does not fit the picture
    /// that it gets, a length except `numbers` is 0, or the network takes too much memory.
    pub fn new(
        [height, width]: [usize; 2],
        convolutions: &[Convolution],
        numbers: usize,
        hidden: &[usize],
        outputs: usize,
    ) -> Result<Self, PictureShapeError> {
        let range = |what, actual, least, most| match actual {
            _ if (least..=most).contains(&actual) => Ok(()),
            _ => Err(PictureShapeError::Range { what, actual, least, most }),
        };
        let len = |what, len| range(what, len, 1, LARGEST);
        let memory = |lens: &[usize]| {
            let actual = lens.iter().fold(1_usize, |product, len| product.saturating_mul(*len));
            range("the number of parameters, or of numbers of a picture,", actual, 1, LIMIT)
        };
        len("the height of a picture", height)?;
        len("the width of a picture", width)?;
        len("the number of convolutions", convolutions.len())?;
        range("the number of other inputs", numbers, 0, LARGEST)?;
        len("the number of outputs", outputs)?;
        hidden.iter().try_for_each(|own| len("the length of a hidden layer", *own))?;
        let (mut sides, mut inputs, mut start, mut layers) = ([height, width], 3, 0, Vec::new());
        for (number, convolution) in convolutions.iter().enumerate() {
            let Convolution { channels, kernel, stride, padding } = *convolution;
            len("a number of channels", channels)?;
            len("a kernel", kernel)?;
            len("a stride", stride)?;
            let [height, width] = sides;
            if padding >= kernel || sides.iter().any(|side| side + 2 * padding < kernel) {
                return Err(PictureShapeError::Kernel { number, kernel, padding, height, width });
            }
            let [height, width] = sides.map(|side| side + 2 * padding);
            memory(&[height, width, inputs])?;
            let grid = Grid { height, width, channels: inputs, kernel, stride };
            let has_biases = number + 1 < convolutions.len();
            let layer = ConvolutionLayer { convolution: *convolution, grid, has_biases, start };
            memory(&[kernel, kernel, inputs, channels])?;
            start += layer.lens().iter().sum::<usize>();
            layers.push(layer);
            (sides, inputs) = (grid.windows(), channels);
            memory(&[height + kernel, width + kernel, inputs])?;
        }
        let head = Shape::new(numbers + 2 * inputs, hidden, outputs, false);
        memory(&[start + head.num_parameters()])?;
        Ok(Self { layers, head })
    }

    /// Returns the convolutions, from the first to the last.
    pub fn convolutions(&self) -> impl ExactSizeIterator<Item = Convolution> + '_ {
        self.layers.iter().map(|layer| layer.convolution)
    }

    pub(super) fn layers(&self) -> &[ConvolutionLayer] {
        &self.layers
    }

    pub(super) fn last_layer(&self) -> &ConvolutionLayer {
        &self.layers[self.layers.len() - 1]
    }

    /// Returns the height and the width of a picture, in pixels.
    #[must_use]
    pub fn picture_size(&self) -> [usize; 2] {
        let ConvolutionLayer { grid, convolution: Convolution { padding, .. }, .. } =
            self.layers[0];
        [grid.height - 2 * padding, grid.width - 2 * padding]
    }

    /// Returns the bytes of a picture.
    #[must_use]
    pub fn picture_len(&self) -> usize {
        let [height, width] = self.picture_size();
        3 * height * width
    }

    /// Returns the number of points to which the spatial softmax reduces a picture: one for each
    /// channel of the last convolution.
    #[must_use]
    pub fn num_points(&self) -> usize {
        self.last_layer().convolution.channels
    }

    /// Returns where a [point](super::PicturePass::points) is in a picture: the column and the row
    /// of pixels, which the middle of the top left one counts from.
    #[must_use]
    pub fn pixel_of(&self, point: [f32; 2]) -> [f32; 2] {
        let [rows, columns] = self.last_layer().grid.windows();
        let places = [columns, rows].map(|len| (len - 1) as f32);
        let mut pixel = [0, 1].map(|axis| (point[axis] + 1.0) / 2.0 * places[axis]);
        for layer in self.layers.iter().rev() {
            let Convolution { kernel, stride, padding, .. } = layer.convolution;
            let middle = (kernel - 1) as f32 / 2.0 - padding as f32;
            pixel = pixel.map(|place| place * stride as f32 + middle);
        }
        pixel
    }

    /// Returns the number of inputs besides the picture.
    #[must_use]
    pub fn num_numbers(&self) -> usize {
        self.head.num_inputs() - 2 * self.num_points()
    }

    /// Returns the number of outputs.
    #[must_use]
    pub fn num_outputs(&self) -> usize {
        self.head.sizes[self.head.sizes.len() - 1]
    }

    /// Returns the lengths of the perceptron's input, hidden layers and output.
    #[cfg(feature = "render")]
    pub(crate) fn perceptron(&self) -> &[usize] {
        &self.head.sizes
    }

    /// Returns the number of parameters.
    #[must_use]
    pub fn num_parameters(&self) -> usize {
        self.head_start() + self.head.num_parameters()
    }

    /// Returns where the perceptron's parameters start.
    pub(super) fn head_start(&self) -> usize {
        let last = self.last_layer();
        last.start + last.lens().iter().sum::<usize>()
    }
}
