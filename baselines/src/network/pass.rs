//! Passes through a network: forward, and backward with gradients.
//!
//! All matrices are row-major, with a row for each input of the batch. Loops over their elements
//! are compiled for the vectors of the processor, with the same bits on each.

use std::fmt;

use super::matrix::Matrix;
use super::perceptron::{Layer, Network, Parameters, ParametersMut, Shape};
use super::product::Product;
use super::vectors::vectorize;

/// Added to a variance before its root is taken: PyTorch's default for layer normalization.
const EPSILON: f32 = 1e-5;

/// A pass of some rows through a network, with everything that its gradient needs. Its memory is
/// reused.
///
/// ```
/// use baselines::learn::network::{Network, Pass, Shape, Trained};
/// use rand::SeedableRng;
/// use rand_chacha::ChaCha8Rng;
///
/// // Learns y = 1 - 2 x from four rows.
/// let (inputs, targets) = ([-1.0, 0.0, 0.5, 1.0], [3.0, 1.0, 0.0, -1.0]);
/// let shape = Shape::new(1, &[16], 1, false);
/// let mut gradient = vec![0.0; shape.num_parameters()];
/// let network = Network::init(shape, 1.0, &mut ChaCha8Rng::seed_from_u64(0));
/// let (mut trained, mut pass) = (Trained::new(network, 0.01), Pass::default());
/// for number in 1..=1_000 {
///     pass.run(trained.network(), &inputs);
///     // The derivative of the squared error with respect to each output.
///     let slope = |row: usize, output: f32| 2.0 * (output - targets[row]);
///     pass.backward(trained.network(), slope, Some(&mut gradient), 0);
///     trained.step(number, 1.0, &gradient);
/// }
/// assert!((pass.run(trained.network(), &[0.25])[0] - 0.5).abs() < 0.1);
/// ```
#[derive(Clone, Default)]
pub struct Pass {
    num_rows: usize,
    input: Vec<f32>,
    layers: Vec<LayerPass>,
    product: Product,
    /// The gradients of the current layer and of the one before it.
    gradients: [Vec<f32>; 2],
}

/// The results of a layer.
#[derive(Clone, Default)]
struct LayerPass {
    output: Vec<f32>,
    /// With normalization: the outputs with mean 0 and variance 1, before scales and shifts.
    normalized: Vec<f32>,
    /// With normalization: one over the standard deviation of each row.
    inverse_std: Vec<f32>,
}

impl fmt::Debug for Pass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Pass").field("num_rows", &self.num_rows).finish_non_exhaustive()
    }
}

impl Pass {
    /// Returns the network's outputs for inputs, a row for each.
    ///
    /// # Panics
    /// Panics if `inputs` is not a number of whole rows.
    pub fn run(&mut self, network: &Network, inputs: &[f32]) -> &[f32] {
        let width = network.shape.num_inputs();
        self.input_mut(inputs.len() / width, width).copy_from_slice(inputs);
        self.forward(&network.shape, &network.parameters)
    }

    /// Returns the network's outputs for inputs whose rows are those of `left`, each followed by its
    /// row of `right`, such as the inputs of a critic and actions.
    ///
    /// # Panics
    /// Panics if there is not the same number of whole rows of both.
    pub fn run_joined(&mut self, network: &Network, left: &[f32], right: &[f32]) -> &[f32] {
        let width = network.shape.num_inputs();
        let num_rows = (left.len() + right.len()) / width;
        let len = left.len() / num_rows.max(1);
        assert_eq!([num_rows * len, num_rows * (width - len)], [left.len(), right.len()]);
        let joined = self.input_mut(num_rows, width).chunks_exact_mut(width);
        let rows = left.chunks_exact(len).zip(right.chunks_exact(width - len));
        for (joined, (left, right)) in joined.zip(rows) {
            joined[..len].copy_from_slice(left);
            joined[len..].copy_from_slice(right);
        }
        self.forward(&network.shape, &network.parameters)
    }

    /// Returns the input of a pass of `num_rows` rows of `width` numbers, for the caller to fill
    /// before [`forward`](Self::forward).
    pub(super) fn input_mut(&mut self, num_rows: usize, width: usize) -> &mut [f32] {
        self.num_rows = num_rows;
        self.input.resize(num_rows * width, 0.0);
        &mut self.input
    }

    /// Returns the outputs of a network with this shape and these parameters.
    pub(super) fn forward(&mut self, shape: &Shape, parameters: &[f32]) -> &[f32] {
        let num_rows = self.num_rows;
        self.layers.resize_with(shape.sizes.len() - 1, LayerPass::default);
        let mut input = self.input.as_slice();
        for (layer, pass) in shape.layers().into_iter().zip(&mut self.layers) {
            let parameters = layer.of(parameters);
            pass.forward(layer, &parameters, input, num_rows, &mut self.product);
            input = &pass.output;
        }
        input
    }

    /// Computes the gradient of a loss after the last [`run`](Self::run) or
    /// [`run_joined`](Self::run_joined), through the same network. `slope` is the derivative of the
    /// loss with respect to an output, given the output's index among those of all rows and its
    /// value. Writes the gradient of the parameters to `parameters` if given, and returns that of the
    /// last `input_width` numbers of each row of the input.
    ///
    /// # Panics
    /// Panics if `parameters` is shorter than the network's, or `input_width` is more than
    /// that of an input.
    pub fn backward(
        &mut self,
        network: &Network,
        slope: impl Fn(usize, f32) -> f32,
        parameters: Option<&mut [f32]>,
        input_width: usize,
    ) -> &[f32] {
        let Network { shape, parameters: weights } = network;
        self.backward_through(shape, weights, slope, parameters, input_width)
    }

    /// As [`backward`](Self::backward), through a network with this shape and these parameters.
    pub(super) fn backward_through(
        &mut self,
        shape: &Shape,
        parameters: &[f32],
        slope: impl Fn(usize, f32) -> f32,
        mut own_gradient: Option<&mut [f32]>,
        input_width: usize,
    ) -> &[f32] {
        let num_rows = self.num_rows;
        let [gradient, before] = &mut self.gradients;
        let outputs = self.layers.last().map_or(&[][..], |layer| &layer.output);
        gradient.clear();
        gradient.extend(outputs.iter().enumerate().map(|(index, output)| slope(index, *output)));
        for (number, layer) in shape.layers().into_iter().enumerate().rev() {
            let pass = &self.layers[number];
            let Parameters { weights, scales, .. } = layer.of(parameters);
            let mut own = own_gradient.as_deref_mut().map(|all| layer.of_mut(all));
            if layer.is_hidden {
                vectorize(
                    #[inline(always)]
                    || {
                        pass.backward_activation(layer, scales, gradient, own.as_mut());
                    },
                );
            }
            let input = if number == 0 { &self.input } else { &self.layers[number - 1].output };
            let matrix = Matrix::new(gradient, layer.num_outputs);
            if let Some(ParametersMut { weights, biases, .. }) = own {
                let input = Matrix::new(input, layer.num_inputs);
                self.product.write(input.transposed(), matrix, weights);
                add_rows(gradient, biases);
            }
            let width = if number == 0 { input_width } else { layer.num_inputs };
            let skipped = (layer.num_inputs - width) * layer.num_outputs;
            before.resize(num_rows * width, 0.0);
            if width > 0 {
                let weights = Matrix::new(&weights[skipped..], layer.num_outputs);
                self.product.write(matrix, weights.transposed(), before);
            }
            std::mem::swap(gradient, before);
        }
        gradient
    }
}

impl LayerPass {
    fn forward(
        &mut self,
        layer: Layer,
        parameters: &Parameters<'_>,
        input: &[f32],
        num_rows: usize,
        product: &mut Product,
    ) {
        let Layer { num_inputs, num_outputs, .. } = layer;
        let Parameters { weights, biases, scales, shifts } = parameters;
        self.output.resize(num_rows * num_outputs, 0.0);
        let (input, weights) = (Matrix::new(input, num_inputs), Matrix::new(weights, num_outputs));
        product.write(input, weights, &mut self.output);
        let lowest = if layer.is_hidden { 0.0 } else { f32::NEG_INFINITY };
        vectorize(
            #[inline(always)]
            || {
                if layer.is_normalized {
                    self.normalize(num_outputs, biases, scales, shifts);
                } else {
                    for row in self.output.chunks_exact_mut(num_outputs) {
                        for (value, bias) in row.iter_mut().zip(*biases) {
                            *value = larger(*value + bias, lowest);
                        }
                    }
                }
            },
        );
    }

    /// Adds biases, normalizes each row, scales and shifts it, and sets negative numbers to 0.
    #[inline(always)]
    fn normalize(&mut self, width: usize, biases: &[f32], scales: &[f32], shifts: &[f32]) {
        self.normalized.resize(self.output.len(), 0.0);
        self.inverse_std.clear();
        let rows = self.output.chunks_exact_mut(width).zip(self.normalized.chunks_exact_mut(width));
        for (output, normalized) in rows {
            output.iter_mut().zip(biases).for_each(|(value, bias)| *value += bias);
            let mean = sum(output, |value| value) / width as f32;
            let variance = sum(output, |value| (value - mean) * (value - mean)) / width as f32;
            let inverse_std = 1.0 / (variance + EPSILON).sqrt();
            self.inverse_std.push(inverse_std);
            let affine = scales.iter().zip(shifts);
            for ((output, normalized), (scale, shift)) in
                output.iter_mut().zip(normalized).zip(affine)
            {
                *normalized = (*output - mean) * inverse_std;
                *output = larger(*normalized * scale + shift, 0.0);
            }
        }
    }

    /// Turns the gradient of the outputs into that of the products of inputs and weights.
    #[inline(always)]
    fn backward_activation(
        &self,
        layer: Layer,
        scales: &[f32],
        gradient: &mut [f32],
        parameters: Option<&mut ParametersMut<'_>>,
    ) {
        for (gradient, output) in gradient.iter_mut().zip(&self.output) {
            *gradient = if *output > 0.0 { *gradient } else { 0.0 };
        }
        if !layer.is_normalized {
            return;
        }
        let width = layer.num_outputs;
        let rows = || self.normalized.chunks_exact(width);
        if let Some(ParametersMut { scales, shifts, .. }) = parameters {
            scales.fill(0.0);
            shifts.fill(0.0);
            for (gradient, normalized) in gradient.chunks_exact(width).zip(rows()) {
                for ((scale, shift), (gradient, normalized)) in
                    scales.iter_mut().zip(&mut **shifts).zip(gradient.iter().zip(normalized))
                {
                    *scale += gradient * normalized;
                    *shift += gradient;
                }
            }
        }
        let rows = gradient.chunks_exact_mut(width).zip(rows()).zip(&self.inverse_std);
        for ((gradient, normalized), inverse_std) in rows {
            gradient.iter_mut().zip(scales).for_each(|(gradient, scale)| *gradient *= scale);
            let mean = sum(gradient, |value| value) / width as f32;
            let product = dot(gradient, normalized) / width as f32;
            for (gradient, normalized) in gradient.iter_mut().zip(normalized) {
                *gradient = inverse_std * (*gradient - mean - normalized * product);
            }
        }
    }
}

/// Writes the sums of the columns of rows, as long as `sums`.
pub(super) fn add_rows(rows: &[f32], sums: &mut [f32]) {
    sums.fill(0.0);
    vectorize(
        #[inline(always)]
        || {
            for row in rows.chunks_exact(sums.len()) {
                sums.iter_mut().zip(row).for_each(|(sum, value)| *sum += value);
            }
        },
    );
}

/// Returns the larger number, or `lowest` for NaN. Of 0 and -0, `f32::max` may return either.
#[inline(always)]
pub(super) fn larger(value: f32, lowest: f32) -> f32 {
    if value > lowest { value } else { lowest }
}

/// The number of partial sums, which one instruction can add at a time.
const LANES: usize = 16;

/// Returns the sum of `term` over numbers, in a fixed order.
#[inline(always)]
fn sum(numbers: &[f32], term: impl Fn(f32) -> f32) -> f32 {
    let (chunks, rest) = numbers.as_chunks::<LANES>();
    let mut sums = [0.0; LANES];
    for chunk in chunks {
        sums.iter_mut().zip(chunk).for_each(|(sum, number)| *sum += term(*number));
    }
    sums.iter().sum::<f32>() + rest.iter().map(|number| term(*number)).sum::<f32>()
}

/// Returns the scalar product, in a fixed order.
#[inline(always)]
fn dot(left: &[f32], right: &[f32]) -> f32 {
    let ((left, left_rest), (right, right_rest)) =
        (left.as_chunks::<LANES>(), right.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (left, right) in left.iter().zip(right) {
        let products = left.iter().zip(right).map(|(left, right)| left * right);
        sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
    }
    let rest = left_rest.iter().zip(right_rest).map(|(left, right)| left * right);
    sums.iter().sum::<f32>() + rest.sum::<f32>()
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::perceptron::{Network, Shape};
    use super::Pass;

    const ROWS: usize = 5;

    /// The gradients of the sum of squared outputs agree with differences of it.
    #[test]
    fn gradients_agree_with_differences() {
        for layer_norm in [false, true] {
            let mut rng = ChaCha8Rng::seed_from_u64(3);
            let shape = Shape::new(4, &[17, 9], 2, layer_norm);
            let network = Network::init(shape, 1.0, &mut rng);
            let inputs: Vec<f32> = (0..ROWS * 4).map(|_| rng.random_range(-1.0..1.0)).collect();
            let mut pass = Pass::default();
            let loss = |network: &Network, inputs: &[f32], pass: &mut Pass| -> f64 {
                let outputs = pass.run(network, inputs);
                outputs.iter().map(|output| f64::from(*output).powi(2)).sum()
            };
            pass.run(&network, &inputs);
            let mut gradient = vec![f32::NAN; network.parameters.len()];
            let slope = |_, output| 2.0 * output;
            let of_inputs = pass.backward(&network, slope, Some(&mut gradient), 3).to_vec();
            let step = 1e-3;
            let close = |computed: f32, high: f64, low: f64, what: &str| {
                let difference = ((high - low) / (2.0 * f64::from(step))) as f32;
                let tolerance = 0.02 * (1.0 + computed.abs());
                assert!(
                    (computed - difference).abs() < tolerance,
                    "{what}: {computed} {difference}"
                );
            };
            for (index, computed) in gradient.iter().enumerate().step_by(7) {
                let [high, low] = [step, -step].map(|step| {
                    let mut other = network.clone();
                    other.parameters[index] += step;
                    loss(&other, &inputs, &mut pass)
                });
                close(*computed, high, low, &format!("parameter {index}, norm {layer_norm}"));
            }
            for (index, computed) in of_inputs.iter().enumerate() {
                // The last three inputs of each row.
                let at = index / 3 * 4 + 1 + index % 3;
                let [high, low] = [step, -step].map(|step| {
                    let mut other = inputs.clone();
                    other[at] += step;
                    loss(&network, &other, &mut pass)
                });
                close(*computed, high, low, &format!("input {at}, norm {layer_norm}"));
            }
        }
    }
}
