//! The cross-entropy method: normal distributions of parameters, fitted to the best candidates.

use rand::{RngExt, SeedableRng, distr::Open01};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

/// The least standard deviation of a parameter, as a share of its first: candidates that are all
/// alike find nothing better.
const LEAST_SPREAD: f64 = 0.1;

/// Independent normal distributions, one for each parameter.
#[derive(Clone, Debug)]
pub(super) struct Normals {
    mean: Vec<f64>,
    std: Vec<f64>,
    least_std: Vec<f64>,
    standard: Normal,
    generator: ChaCha8Rng,
}

impl Normals {
    pub(super) fn new(mean: Vec<f64>, std: Vec<f64>, seed: u64) -> Self {
        let least_std = std.iter().map(|std| LEAST_SPREAD * std).collect();
        let generator = ChaCha8Rng::seed_from_u64(seed);
        Self { mean, std, least_std, standard: Normal::standard(), generator }
    }

    /// Draws the parameters of a candidate.
    pub(super) fn draw(&mut self) -> Vec<f64> {
        let Self { mean, std, standard, generator, .. } = self;
        let parameters = mean.iter().zip(&*std);
        parameters
            .map(|(mean, std)| mean + std * standard.inverse_cdf(generator.sample(Open01)))
            .collect()
    }

    /// Takes mean and standard deviation of each parameter from candidates.
    pub(super) fn fit(&mut self, candidates: &[&[f64]]) {
        let count = candidates.len() as f64;
        for (index, (mean, std)) in self.mean.iter_mut().zip(&mut self.std).enumerate() {
            let values = || candidates.iter().map(|parameters| parameters[index]);
            *mean = values().sum::<f64>() / count;
            let variance = values().map(|value| (value - *mean).powi(2)).sum::<f64>() / count;
            *std = variance.sqrt().max(self.least_std[index]);
        }
    }
}
