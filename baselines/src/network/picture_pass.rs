//! Passes through networks that see pictures: forward, and backward with gradients.

use std::fmt;
use std::mem;
use std::sync::{Mutex, MutexGuard, PoisonError};

use rayon::prelude::*;

use super::matrix::Matrix;
use super::packing::resized;
use super::pass::{Pass, add_rows, larger};
use super::picture_network::PictureNetwork;
use super::picture_shape::{Convolution, ConvolutionLayer, PictureShape};
use super::product::Product;
use super::spatial_softmax::{self, Pixels};
use super::vectors::vectorize;
use super::windows::{Windows, WindowsTransposed};

/// The pictures whose gradients are added first. A constant, so that the order of sums depends on
/// no number of threads. So many pass through a layer in the processor's cache.
const GROUP: usize = 4;

/// A pass of some pictures and numbers through a network, with everything that its gradient needs.
/// Its memory is reused.
///
/// The threads of the rayon pool in which it is called share the pictures, with the same bits on any
/// number of them.
#[derive(Default)]
pub struct PicturePass {
    shape: Option<PictureShape>,
    groups: Vec<Group>,
    spare: Mutex<Vec<Work>>,
    /// The weights of each convolution, turned.
    turned: Vec<Vec<f32>>,
    points: Vec<f32>,
    head: Pass,
}

/// Some pictures.
#[derive(Default)]
struct Group {
    num_pictures: usize,
    /// The padded pictures that each convolution gets.
    inputs: Vec<Vec<f32>>,
    /// The shares of the pixels in each channel of the last convolution.
    shares: Vec<f32>,
    /// The gradient of the convolutions' parameters.
    gradient: Vec<f32>,
}

/// The memory of a thread, which holds nothing between two groups.
#[derive(Default)]
struct Work {
    product: Product,
    outputs: Vec<f32>,
    gradient: Vec<f32>,
    /// The gradient of each convolution's outputs, between zeros.
    spread: Vec<Vec<f32>>,
    scratch: Vec<f32>,
}

impl fmt::Debug for PicturePass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("PicturePass").field("shape", &self.shape).finish_non_exhaustive()
    }
}

impl PicturePass {
    /// Returns the network's outputs for pictures and numbers, a row for each.
    ///
    /// # Panics
    /// Panics if there is not the same number of whole rows of both.
    pub fn run(&mut self, network: &PictureNetwork, pictures: &[u8], numbers: &[f32]) -> &[f32] {
        let shape = &network.shape;
        let (picture_len, num_numbers) = (shape.picture_len(), shape.num_numbers());
        let num_rows = pictures.len() / picture_len;
        let lens = [num_rows * picture_len, num_rows * num_numbers];
        assert_eq!(lens, [pictures.len(), numbers.len()]);
        self.prepare(shape, num_rows);
        let Self { groups, spare, points, head, .. } = self;
        let points_len = 2 * shape.num_points();
        points.resize(num_rows * points_len, 0.0);
        let rows = pictures.par_chunks(GROUP * picture_len);
        let rows = rows.zip(points.par_chunks_mut(GROUP * points_len));
        share(groups, spare, rows, |group, work, (pictures, points)| {
            group.forward(network, pictures, points, work);
        });
        let width = num_numbers + points_len;
        let inputs = head.input_mut(num_rows, width).chunks_exact_mut(width);
        for (row, (input, points)) in inputs.zip(points.chunks_exact(points_len)).enumerate() {
            let (own_numbers, own_points) = input.split_at_mut(num_numbers);
            own_numbers.copy_from_slice(&numbers[row * num_numbers..][..num_numbers]);
            own_points.copy_from_slice(points);
        }
        head.forward(&shape.head, &network.parameters()[shape.head_start()..])
    }

    /// Returns the points of the last [`run`](Self::run): for each row the x of each channel, and
    /// then the y of each, from -1, left or top, to 1.
    #[must_use]
    pub fn points(&self) -> &[f32] {
        &self.points
    }

    /// Computes the gradient of a loss after the last [`run`](Self::run), through the same network,
    /// and writes that of the parameters to `gradient`. `slope` is the derivative of the loss with
    /// respect to an output, given the output's index among those of all rows and its value.
    ///
    /// # Panics
    /// Panics if `gradient` has not as many numbers as the network has parameters, or no network of
    /// this shape was run.
    pub fn backward(
        &mut self,
        network: &PictureNetwork,
        slope: impl Fn(usize, f32) -> f32,
        gradient: &mut [f32],
    ) {
        let shape = &network.shape;
        assert_eq!((self.shape.as_ref(), shape.num_parameters()), (Some(shape), gradient.len()));
        let Self { groups, spare, turned, points, head, .. } = self;
        let (gradient, of_head) = gradient.split_at_mut(shape.head_start());
        let parameters = &network.parameters()[shape.head_start()..];
        let points_len = 2 * shape.num_points();
        let by_points =
            head.backward_through(&shape.head, parameters, slope, Some(of_head), points_len);
        turned.resize_with(shape.layers().len(), Vec::new);
        // Nobody asks for the gradient of bytes.
        for (layer, turned) in shape.layers().iter().zip(&mut *turned).skip(1) {
            turn(layer, network.parameters(), turned);
        }
        let len = GROUP * points_len;
        let rows = points.par_chunks(len).zip(by_points.par_chunks(len));
        share(groups, spare, rows, |group, work, (points, by_points)| {
            group.backward(shape, turned, points, by_points, work);
        });
        gradient.fill(0.0);
        vectorize(
            #[inline(always)]
            || {
                for group in groups.iter() {
                    gradient.iter_mut().zip(&group.gradient).for_each(|(sum, own)| *sum += own);
                }
            },
        );
    }

    /// Prepares memory for some rows.
    fn prepare(&mut self, shape: &PictureShape, num_rows: usize) {
        if self.shape.as_ref() != Some(shape) {
            *self = Self { shape: Some(shape.clone()), ..Self::default() };
        }
        self.groups.resize_with(num_rows.div_ceil(GROUP), Group::default);
        for (number, group) in self.groups.iter_mut().enumerate() {
            group.num_pictures = GROUP.min(num_rows - number * GROUP);
            group.inputs.resize_with(shape.layers().len(), Vec::new);
        }
    }
}

/// Calls a function with each group, its rows and memory, on the threads of the pool.
fn share<T: Send>(
    groups: &mut [Group],
    spare: &Mutex<Vec<Work>>,
    rows: impl IndexedParallelIterator<Item = T>,
    each: impl Fn(&mut Group, &mut Work, T) + Sync,
) {
    // What a panic leaves is memory all the same.
    let spare = || -> MutexGuard<'_, _> { spare.lock().unwrap_or_else(PoisonError::into_inner) };
    groups.par_iter_mut().zip(rows).for_each(|(group, rows)| {
        let mut work = spare().pop().unwrap_or_default();
        each(group, &mut work, rows);
        spare().push(work);
    });
}

impl Group {
    fn forward(
        &mut self,
        network: &PictureNetwork,
        pictures: &[u8],
        points: &mut [f32],
        work: &mut Work,
    ) {
        let Self { num_pictures, inputs, shares, .. } = self;
        let (num_pictures, shape) = (*num_pictures, &network.shape);
        let Work { product, outputs, scratch, .. } = work;
        let first = &shape.layers()[0];
        write_pixels(network, pictures, resized(&mut inputs[0], num_pictures * first.grid.len()));
        for (number, layer) in shape.layers().iter().enumerate() {
            let (grid, channels) = (layer.grid, layer.convolution.channels);
            let [weights, biases] = layer.of(network.parameters());
            let next = shape.layers().get(number + 1);
            let outputs = if next.is_some() { &mut *outputs } else { &mut *shares };
            let outputs = resized(outputs, num_pictures * layer.output_len());
            let pictures = &inputs[number][..num_pictures * grid.len()];
            product.write_left(Windows { pictures, grid }, Matrix::new(weights, channels), outputs);
            if let Some(next) = next {
                let input = resized(&mut inputs[number + 1], num_pictures * next.grid.len());
                vectorize(
                    #[inline(always)]
                    || activate(outputs, biases, next, input),
                );
            }
        }
        let last = shape.last_layer();
        let rows = shares.chunks_exact_mut(last.output_len());
        for (shares, points) in rows.zip(points.chunks_exact_mut(2 * shape.num_points())) {
            spatial_softmax::forward(pixels(last), shares, points, scratch);
        }
    }

    fn backward(
        &mut self,
        shape: &PictureShape,
        turned: &[Vec<f32>],
        points: &[f32],
        by_points: &[f32],
        work: &mut Work,
    ) {
        let Self { num_pictures, inputs, shares, gradient: own } = self;
        let (num_pictures, last) = (*num_pictures, shape.last_layer());
        let Work { product, outputs: before, gradient, spread, .. } = work;
        own.resize(shape.head_start(), 0.0);
        spread.resize_with(shape.layers().len(), Vec::new);
        let len = 2 * shape.num_points();
        let rows = shares.chunks_exact(last.output_len());
        let rows = rows.zip(points.chunks_exact(len).zip(by_points.chunks_exact(len)));
        let gradients = resized(gradient, num_pictures * last.output_len());
        for (gradient, (shares, (points, by_points))) in
            gradients.chunks_exact_mut(last.output_len()).zip(rows)
        {
            spatial_softmax::backward(pixels(last), shares, points, by_points, gradient);
        }
        for (number, layer) in shape.layers().iter().enumerate().rev() {
            let (grid, channels) = (layer.grid, layer.convolution.channels);
            let [weights, biases] = layer.of_mut(own);
            let gradients = &gradient[..num_pictures * layer.output_len()];
            let pictures = &inputs[number][..num_pictures * grid.len()];
            let windows = WindowsTransposed(Windows { pictures, grid });
            product.write_left(windows, Matrix::new(gradients, channels), weights);
            if layer.has_biases {
                add_rows(gradients, biases);
            }
            if number == 0 {
                break;
            }
            let grid = layer.back();
            let spread = resized(&mut spread[number], num_pictures * grid.len());
            write_spread(layer, gradients, spread);
            let windows = Windows { pictures: spread, grid };
            let before_len = num_pictures * shape.layers()[number - 1].output_len();
            let turned = Matrix::new(&turned[number], layer.grid.channels);
            product.write_left(windows, turned, resized(before, before_len));
            vectorize(
                #[inline(always)]
                || mask(layer, pictures, &mut before[..before_len]),
            );
            mem::swap(gradient, before);
        }
    }
}

/// Returns where the points of the spatial softmax are.
const fn pixels(last: &ConvolutionLayer) -> Pixels {
    let [height, width] = last.grid.windows();
    Pixels { height, width }
}

/// Returns where each row of the pixels without padding starts in the input of a convolution.
fn inner_rows(layer: &ConvolutionLayer, input_len: usize) -> impl Iterator<Item = usize> {
    let (grid, padding) = (layer.grid, layer.convolution.padding);
    let first = padding * (grid.row_len() + grid.channels);
    let rows =
        move |start| (0..grid.height - 2 * padding).map(move |row| start + row * grid.row_len());
    (first..input_len).step_by(grid.len()).flat_map(rows)
}

/// Writes pictures without their mean, to scale, to the input of the first convolution.
fn write_pixels(network: &PictureNetwork, pictures: &[u8], input: &mut [f32]) {
    let layer = &network.shape.layers()[0];
    let (mean, scale) = network.mean_and_scale();
    let len = layer.inner_row_len();
    let means = mean.chunks_exact(len).cycle();
    vectorize(
        #[inline(always)]
        || {
            let rows = pictures.chunks_exact(len).zip(means.clone());
            for (start, (bytes, means)) in inner_rows(layer, input.len()).zip(rows) {
                let columns = bytes.iter().zip(means);
                for (number, (byte, mean)) in input[start..][..len].iter_mut().zip(columns) {
                    *number = (f32::from(*byte) - mean) * scale;
                }
            }
        },
    );
}

/// Adds biases to the outputs of a convolution, sets negative numbers to 0, and writes them to the
/// input of the next one.
#[inline(always)]
fn activate(outputs: &[f32], biases: &[f32], next: &ConvolutionLayer, input: &mut [f32]) {
    let len = next.inner_row_len();
    for (start, row) in inner_rows(next, input.len()).zip(outputs.chunks_exact(len)) {
        let pixels = input[start..][..len].chunks_exact_mut(biases.len());
        for (to, from) in pixels.zip(row.chunks_exact(biases.len())) {
            for (to, (from, bias)) in to.iter_mut().zip(from.iter().zip(biases)) {
                *to = larger(from + bias, 0.0);
            }
        }
    }
}

/// Sets the gradient of a convolution's input to 0 where the units before it are inactive.
#[inline(always)]
fn mask(layer: &ConvolutionLayer, input: &[f32], gradient: &mut [f32]) {
    let len = layer.inner_row_len();
    for (start, gradient) in inner_rows(layer, input.len()).zip(gradient.chunks_exact_mut(len)) {
        for (gradient, input) in gradient.iter_mut().zip(&input[start..][..len]) {
            *gradient = if *input > 0.0 { *gradient } else { 0.0 };
        }
    }
}

/// Writes the gradient of a convolution's outputs to pictures of [`ConvolutionLayer::back`].
fn write_spread(layer: &ConvolutionLayer, gradient: &[f32], spread: &mut [f32]) {
    let (grid, [rows, columns]) = (layer.back(), layer.grid.windows());
    let Convolution { channels, kernel, stride, padding } = layer.convolution;
    let border = kernel - 1 - padding;
    for (row, gradient) in gradient.chunks_exact(columns * channels).enumerate() {
        let (picture, row) = (row / rows, row % rows);
        let start =
            picture * grid.len() + (border + row * stride) * grid.row_len() + border * channels;
        let pixels = spread[start..].chunks_mut(stride * channels);
        for (to, from) in pixels.zip(gradient.chunks_exact(channels)) {
            to[..channels].copy_from_slice(from);
        }
    }
}

/// Writes the weights of a convolution for [`ConvolutionLayer::back`]: the pixels of a window in the
/// opposite order, and for each a row for each output.
fn turn(layer: &ConvolutionLayer, parameters: &[f32], turned: &mut Vec<f32>) {
    let [weights, _] = layer.of(parameters);
    let (inputs, outputs) = (layer.grid.channels, layer.convolution.channels);
    turned.clear();
    for pixel in weights.chunks_exact(inputs * outputs).rev() {
        for output in 0..outputs {
            turned.extend(pixel.iter().skip(output).step_by(outputs));
        }
    }
}
