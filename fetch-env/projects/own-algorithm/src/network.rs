//! Multilayer perceptrons with rectified linear units, and their optimizer.

use rand::{Rng, RngExt};

/// A network whose parameters lie in one vector: of each layer the weights, a row for each input,
/// and the biases.
#[derive(Clone, Debug)]
pub struct Network {
    /// The lengths of the input, of the hidden layers and of the output.
    sizes: Vec<usize>,
    pub parameters: Vec<f32>,
}

impl Network {
    /// Draws parameters from `[-1 / sqrt(inputs), 1 / sqrt(inputs)]`.
    pub fn new(sizes: Vec<usize>, rng: &mut impl Rng) -> Self {
        let mut parameters = Vec::new();
        for pair in sizes.windows(2) {
            let bound = 1.0 / (pair[0] as f32).sqrt();
            let len = (pair[0] + 1) * pair[1];
            parameters.extend((0..len).map(|_| rng.random_range(-bound..=bound)));
        }
        Self { sizes, parameters }
    }

    /// Returns the number of inputs, the weights and the biases of each layer.
    pub fn layers(&self) -> impl Iterator<Item = (usize, &[f32], &[f32])> {
        let mut rest = self.parameters.as_slice();
        self.sizes.windows(2).map(move |pair| {
            let (weights, others) = rest.split_at(pair[0] * pair[1]);
            let (biases, others) = others.split_at(pair[1]);
            rest = others;
            (pair[0], weights, biases)
        })
    }
}

/// What the layers of a network have computed for some rows: the inputs, and the outputs of each
/// layer.
pub struct Pass {
    outputs: Vec<Vec<f32>>,
}

impl Pass {
    pub fn run(network: &Network, inputs: Vec<f32>) -> Self {
        let mut outputs = vec![inputs];
        let last = network.sizes.len() - 2;
        for (number, (num_inputs, weights, biases)) in network.layers().enumerate() {
            let mut layer = Vec::new();
            for input in outputs[number].chunks_exact(num_inputs) {
                let start = layer.len();
                layer.extend_from_slice(biases);
                let output = &mut layer[start..];
                for (x, weights) in input.iter().zip(weights.chunks_exact(biases.len())) {
                    output.iter_mut().zip(weights).for_each(|(sum, weight)| *sum += x * weight);
                }
                if number < last {
                    output.iter_mut().for_each(|value| *value = value.max(0.0));
                }
            }
            outputs.push(layer);
        }
        Self { outputs }
    }

    pub fn outputs(&self) -> &[f32] {
        &self.outputs[self.outputs.len() - 1]
    }

    /// Returns the gradients of the parameters and of the inputs, given that of the outputs.
    pub fn backward(&self, network: &Network, slopes: &[f32]) -> (Vec<f32>, Vec<f32>) {
        let mut gradient = Vec::new();
        let mut slopes = slopes.to_vec();
        let layers: Vec<_> = network.layers().collect();
        for (number, (num_inputs, weights, biases)) in layers.into_iter().enumerate().rev() {
            let num_outputs = biases.len();
            let mut of_layer = vec![0.0; weights.len() + num_outputs];
            let (by_weight, by_bias) = of_layer.split_at_mut(weights.len());
            let mut before = Vec::with_capacity(self.outputs[number].len());
            let rows = self.outputs[number].chunks_exact(num_inputs);
            for (input, slope) in rows.zip(slopes.chunks_exact(num_outputs)) {
                by_bias.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += slope);
                let weights = weights.chunks_exact(num_outputs);
                let by_weight = by_weight.chunks_exact_mut(num_outputs);
                for ((x, weights), by_weight) in input.iter().zip(weights).zip(by_weight) {
                    by_weight.iter_mut().zip(slope).for_each(|(sum, slope)| *sum += x * slope);
                    let by_input = weights.iter().zip(slope).map(|(w, slope)| w * slope).sum();
                    // Where a rectified linear unit is at 0, so is its slope.
                    before.push(if number > 0 && *x <= 0.0 { 0.0 } else { by_input });
                }
            }
            gradient.splice(0..0, of_layer);
            slopes = before;
        }
        (gradient, slopes)
    }
}

/// Adam, with the defaults of its authors.
#[derive(Debug)]
pub struct Adam {
    learning_rate: f32,
    pub first_moment: Vec<f32>,
    pub second_moment: Vec<f32>,
}

impl Adam {
    pub fn new(learning_rate: f32, len: usize) -> Self {
        Self { learning_rate, first_moment: vec![0.0; len], second_moment: vec![0.0; len] }
    }

    /// Takes step `number`, counted from 1, against a gradient.
    pub fn step(&mut self, number: u64, parameters: &mut [f32], gradient: &[f32]) {
        let correction = |beta: f32| 1.0 - beta.powf(number as f32);
        let rate = self.learning_rate * correction(0.999).sqrt() / correction(0.9);
        let moments = self.first_moment.iter_mut().zip(&mut self.second_moment);
        for ((parameter, (first, second)), slope) in
            parameters.iter_mut().zip(moments).zip(gradient)
        {
            *first = 0.9 * *first + 0.1 * slope;
            *second = 0.999 * *second + 0.001 * slope * slope;
            *parameter -= rate * *first / (second.sqrt() + 1e-8);
        }
    }
}
