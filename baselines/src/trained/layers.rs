//! The layers of a policy, from and to a network that learns.

use super::LayerWeights;
use crate::network::Network;
use crate::network::perceptron::{Layer, Parameters, ParametersMut};

impl Network {
    /// Returns the weights of all layers, without normalizations: what
    /// [`Algorithm::greedy_layers`](crate::learn::Algorithm::greedy_layers) returns of an actor.
    #[must_use]
    pub fn layer_weights(&self) -> Vec<LayerWeights> {
        let weights = |layer: Layer| {
            let Parameters { weights, biases, .. } = layer.of(&self.parameters);
            LayerWeights {
                num_inputs: layer.num_inputs,
                weights: weights.to_vec(),
                biases: biases.to_vec(),
            }
        };
        self.shape.layers().into_iter().map(weights).collect()
    }

    /// Replaces weights and biases by those of layers, which may have fewer outputs: then the first
    /// ones of each layer.
    pub(crate) fn set_layer_weights(&mut self, layers: &[LayerWeights]) {
        for (layer, new) in self.shape.layers().into_iter().zip(layers) {
            let ParametersMut { weights, biases, .. } = layer.of_mut(&mut self.parameters);
            let rows = weights.chunks_exact_mut(layer.num_outputs);
            for (own, new) in rows.zip(new.weights.chunks_exact(new.biases.len())) {
                own[..new.len()].copy_from_slice(new);
            }
            biases[..new.biases.len()].copy_from_slice(&new.biases);
        }
    }
}
