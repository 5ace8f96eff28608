//! The cross-entropy method: normal distributions of parameters, fitted to the best candidates.

use rand::{RngExt, SeedableRng, distr::Open01};
use rand_chacha::ChaCha8Rng;
use statrs::distribution::{ContinuousCDF, Normal};

/// The least standard deviation of a parameter, as a share of its initial one: candidates that are
/// all alike find nothing better.
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

    /// Fits the mean and standard deviation of each parameter to candidates.
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

#[cfg(test)]
mod tests {
    use super::Normals;

    #[test]
    fn the_best_candidates_lead_to_the_minimum() {
        let mut normals = Normals::new(vec![0.0; 3], vec![1.0; 3], 5);
        let cost = |x: &[f64]| x.iter().map(|x| (x - 0.7).powi(2)).sum::<f64>();
        for _ in 0..30 {
            let mut candidates: Vec<_> = (0..40).map(|_| normals.draw()).collect();
            candidates.sort_by(|one, other| cost(one).total_cmp(&cost(other)));
            normals.fit(&candidates[..8].iter().map(Vec::as_slice).collect::<Vec<_>>());
        }
        assert!(cost(&normals.mean) < 0.02, "{normals:?}");
        assert_eq!(normals.std, normals.least_std);
    }

    #[test]
    fn candidates_have_the_distribution() {
        let mut normals = Normals::new(vec![2.0], vec![0.5], 1);
        let candidates: Vec<_> = (0..20_000).map(|_| normals.draw()).collect();
        normals.fit(&candidates.iter().map(Vec::as_slice).collect::<Vec<_>>());
        assert!((normals.mean[0] - 2.0).abs() < 0.02, "{normals:?}");
        assert!((normals.std[0] - 0.5).abs() < 0.01, "{normals:?}");
    }
}
