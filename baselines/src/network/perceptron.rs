//! Networks: multilayer perceptrons whose parameters lie in one vector.

use std::fmt;

use rand::{Rng, RngExt};

use super::vectors::{follow, parts, parts_mut};

/// The shape of a [`Network`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Shape {
    /// The lengths of the input, of the hidden layers and of the output.
    pub(crate) sizes: Vec<usize>,
    /// Whether hidden layers are normalized.
    pub(crate) layer_norm: bool,
}

/// The places of a layer's parameters in the vector of all parameters.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layer {
    pub(crate) num_inputs: usize,
    pub(crate) num_outputs: usize,
    /// Where the weights start, a row for each input; the biases follow, and then the scales and
    /// the shifts of the normalization, if there is one.
    start: usize,
    pub(crate) is_hidden: bool,
    pub(crate) is_normalized: bool,
}

/// The parameters of a layer, or their gradient.
pub(crate) struct Parameters<'a> {
    pub(crate) weights: &'a [f32],
    pub(crate) biases: &'a [f32],
    /// Empty without normalization.
    pub(crate) scales: &'a [f32],
    pub(crate) shifts: &'a [f32],
}

/// The gradient of a layer's parameters.
pub(crate) struct ParametersMut<'a> {
    pub(crate) weights: &'a mut [f32],
    pub(crate) biases: &'a mut [f32],
    pub(crate) scales: &'a mut [f32],
    pub(crate) shifts: &'a mut [f32],
}

impl Shape {
    /// Describes a network with inputs, hidden layers and outputs of these lengths, each at least 1.
    /// With `layer_norm`, hidden layers are normalized before their rectified linear units.
    #[must_use]
    pub fn new(inputs: usize, hidden: &[usize], outputs: usize, layer_norm: bool) -> Self {
        Self { sizes: [&[inputs], hidden, &[outputs]].concat(), layer_norm }
    }

    /// Returns the length of an input.
    #[must_use]
    pub fn num_inputs(&self) -> usize {
        self.sizes[0]
    }

    /// Returns the layers, from the first to the last.
    pub(crate) fn layers(&self) -> Vec<Layer> {
        let num_layers = self.sizes.len() - 1;
        let mut start = 0;
        (0..num_layers)
            .map(|number| {
                let is_hidden = number + 1 < num_layers;
                let layer = Layer {
                    num_inputs: self.sizes[number],
                    num_outputs: self.sizes[number + 1],
                    start,
                    is_hidden,
                    is_normalized: is_hidden && self.layer_norm,
                };
                start += layer.lens().iter().sum::<usize>();
                layer
            })
            .collect()
    }

    /// Returns the number of parameters.
    #[must_use]
    pub fn num_parameters(&self) -> usize {
        self.layers().iter().flat_map(|layer| layer.lens()).sum()
    }

    /// Draws parameters, as [`Network::init`] does.
    pub(super) fn init(&self, last_scale: f32, rng: &mut impl Rng, parameters: &mut [f32]) {
        for layer in self.layers() {
            let scale = if layer.is_hidden { 1.0 } else { last_scale };
            let ParametersMut { weights, biases, scales, .. } = layer.of_mut(parameters);
            draw_layer(scale, layer.num_inputs, rng, [weights, biases]);
            scales.fill(1.0);
        }
    }
}

/// Draws weights and biases of a layer uniformly from `[-scale / sqrt(inputs), scale / sqrt(inputs)]`.
pub(super) fn draw_layer(
    scale: f32,
    num_inputs: usize,
    rng: &mut impl Rng,
    parameters: [&mut [f32]; 2],
) {
    let bound = scale / (num_inputs as f32).sqrt();
    for numbers in parameters {
        numbers.fill_with(|| rng.random_range(-bound..=bound));
    }
}

impl Layer {
    /// Returns the numbers of weights, biases, scales and shifts.
    const fn lens(self) -> [usize; 4] {
        let norm_len = if self.is_normalized { self.num_outputs } else { 0 };
        [self.num_inputs * self.num_outputs, self.num_outputs, norm_len, norm_len]
    }

    /// Returns the parameters of this layer among all of a network.
    pub(crate) fn of(self, parameters: &[f32]) -> Parameters<'_> {
        let [weights, biases, scales, shifts] = parts(&parameters[self.start..], self.lens());
        Parameters { weights, biases, scales, shifts }
    }

    /// Returns the gradient of this layer's parameters.
    pub(crate) fn of_mut(self, gradient: &mut [f32]) -> ParametersMut<'_> {
        let [weights, biases, scales, shifts] = parts_mut(&mut gradient[self.start..], self.lens());
        ParametersMut { weights, biases, scales, shifts }
    }
}

/// A multilayer perceptron with rectified linear units, and optionally layer normalization before
/// each of them. Its outputs have no bounds.
///
/// All parameters lie in one vector, as their gradient does.
#[derive(Clone)]
pub struct Network {
    pub(crate) shape: Shape,
    pub(crate) parameters: Vec<f32>,
}

impl fmt::Debug for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Network").field("shape", &self.shape).finish_non_exhaustive()
    }
}

impl Network {
    /// Draws weights and biases uniformly from `[-1 / sqrt(inputs), 1 / sqrt(inputs)]`, as PyTorch
    /// does, those of the last layer times `last_scale`.
    #[must_use]
    pub fn init(shape: Shape, last_scale: f32, rng: &mut impl Rng) -> Self {
        let mut parameters = vec![0.0; shape.num_parameters()];
        shape.init(last_scale, rng, &mut parameters);
        Self { shape, parameters }
    }

    /// Returns the shape.
    #[must_use]
    pub const fn shape(&self) -> &Shape {
        &self.shape
    }

    /// Moves the parameters a fraction of the way towards those of another network of the same
    /// shape, as target networks do.
    pub fn follow(&mut self, other: &Self, fraction: f32) {
        follow(&mut self.parameters, &other.parameters, fraction);
    }

    /// Returns the parameters with their name, for [`StateMut::push`](crate::learn::StateMut::push).
    pub fn vectors_mut(&mut self) -> [(&'static str, &mut Vec<f32>); 1] {
        [("parameters", &mut self.parameters)]
    }
}
