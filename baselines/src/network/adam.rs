//! The optimizer and the networks that it trains.

use super::perceptron::Network;
use super::vectors::vectorize;

/// Adam, with the defaults of its authors: Kingma and Ba, *Adam: a method for stochastic
/// optimization*, 2015.
#[derive(Clone, Debug)]
pub struct Adam {
    learning_rate: f32,
    first_moment: Vec<f32>,
    second_moment: Vec<f32>,
}

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Moments below this become 0. Those of a unit that is never active decay forever, and processors
/// are many times slower with numbers below 1.2e-38.
const SMALLEST: f32 = 1e-30;

impl Adam {
    /// Creates an optimizer of `len` parameters.
    #[must_use]
    pub fn new(learning_rate: f32, len: usize) -> Self {
        let zeros = vec![0.0; len];
        Self { learning_rate, first_moment: zeros.clone(), second_moment: zeros }
    }

    /// Moves parameters against a gradient, in step `number`, counted from 1, by `rate_factor`
    /// times the learning rate. Both slices have the length that the optimizer was created for.
    pub fn step(
        &mut self,
        number: u64,
        rate_factor: f32,
        parameters: &mut [f32],
        gradient: &[f32],
    ) {
        let correction = |beta: f32| 1.0 - libm::powf(beta, number as f32);
        let rate =
            rate_factor * self.learning_rate * correction(BETA_2).sqrt() / correction(BETA_1);
        vectorize(
            #[inline(always)]
            || {
                let moments = self.first_moment.iter_mut().zip(&mut self.second_moment);
                for ((parameter, (first, second)), gradient) in
                    parameters.iter_mut().zip(moments).zip(gradient)
                {
                    let moment = BETA_1 * *first + (1.0 - BETA_1) * gradient;
                    *first = if moment.abs() < SMALLEST { 0.0 } else { moment };
                    let moment = BETA_2 * *second + (1.0 - BETA_2) * gradient * gradient;
                    *second = if moment < SMALLEST { 0.0 } else { moment };
                    *parameter -= rate * *first / (second.sqrt() + EPSILON);
                }
            },
        );
    }

    /// Returns the moments, each with its name, for
    /// [`StateMut::push`](crate::learn::StateMut::push).
    pub fn vectors_mut(&mut self) -> [(&'static str, &mut Vec<f32>); 2] {
        let Self { first_moment, second_moment, .. } = self;
        [("first_moment", first_moment), ("second_moment", second_moment)]
    }
}

/// A network with its optimizer.
#[derive(Clone, Debug)]
pub struct Trained {
    pub(crate) network: Network,
    adam: Adam,
}

impl Trained {
    /// Gives a network its optimizer.
    #[must_use]
    pub fn new(network: Network, learning_rate: f32) -> Self {
        let adam = Adam::new(learning_rate, network.parameters.len());
        Self { network, adam }
    }

    /// Returns the network.
    #[must_use]
    pub const fn network(&self) -> &Network {
        &self.network
    }

    /// Takes step `number`, counted from 1, against a gradient, by `rate_factor` times the learning
    /// rate. The gradient has a number for each [parameter](super::Shape::num_parameters).
    pub fn step(&mut self, number: u64, rate_factor: f32, gradient: &[f32]) {
        self.adam.step(number, rate_factor, &mut self.network.parameters, gradient);
    }

    /// Returns the parameters and the moments, each with its name, for
    /// [`StateMut::push`](crate::learn::StateMut::push).
    pub fn vectors_mut(&mut self) -> [(&'static str, &mut Vec<f32>); 3] {
        let ([parameters], [first, second]) = (self.network.vectors_mut(), self.adam.vectors_mut());
        [parameters, first, second]
    }
}
