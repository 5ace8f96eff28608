//! Estimates with confidence intervals, and tests of two samples.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use statrs::{
    distribution::{ChiSquared, ContinuousCDF, Normal, StudentsT},
    stats_tests::{Alternative, fisher::fishers_exact},
};

use crate::error::EvaluationError;

/// An estimate with its 95 % confidence interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The estimate itself.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

const CONFIDENCE: f64 = 0.95;

impl Estimate {
    /// Returns the mean of a sample with Student's interval, which is unbounded for a single value.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] for an empty sample.
    pub fn mean(sample: &[f64]) -> Result<Self, EvaluationError> {
        let count = sample.len() as f64;
        let value = match sample {
            [] => return Err(EvaluationError::NoEpisodes),
            _ => sample.iter().sum::<f64>() / count,
        };
        let variance = sample.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (count - 1.0);
        let half_width = match StudentsT::new(0.0, 1.0, count - 1.0) {
            Ok(student) => student.inverse_cdf(0.5 + 0.5 * CONFIDENCE) * (variance / count).sqrt(),
            Err(_) => f64::INFINITY, // one value, no degree of freedom
        };
        Ok(Self { value, low: value - half_width, high: value + half_width })
    }

    /// Returns the interquartile mean of a sample, its mean without the lowest and the highest quarter,
    /// with the percentile interval of a bootstrap. `seed` decides the resamples.
    ///
    /// Source: Agarwal et al., "Deep reinforcement learning at the edge of the statistical
    /// precipice", NeurIPS (2021), for the runs of one task.
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] for an empty sample.
    pub fn interquartile_mean(sample: &[f64], seed: u64) -> Result<Self, EvaluationError> {
        if sample.is_empty() {
            return Err(EvaluationError::NoEpisodes);
        }
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut resample = sample.to_vec();
        let mut means: Vec<f64> = (0..RESAMPLES)
            .map(|_| {
                resample.fill_with(|| sample[rng.random_range(0..sample.len())]);
                interquartile_mean(&mut resample)
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let quantile = |share: f64| means[(share * (RESAMPLES - 1) as f64).round() as usize];
        Ok(Self {
            value: interquartile_mean(&mut sample.to_vec()),
            low: quantile(0.5 - 0.5 * CONFIDENCE),
            high: quantile(0.5 + 0.5 * CONFIDENCE),
        })
    }

    /// Returns a share of successes with Wilson's interval, which stays within 0 and 1.
    ///
    /// Source: E. B. Wilson, "Probable inference, the law of succession, and statistical
    /// inference", JASA 22 (1927).
    ///
    /// # Errors
    /// [`EvaluationError::NoEpisodes`] if `count` is 0.
    pub fn share(successes: usize, count: usize) -> Result<Self, EvaluationError> {
        if count == 0 {
            return Err(EvaluationError::NoEpisodes);
        }
        let n = count as f64;
        let p = successes as f64 / n;
        let z = Normal::standard().inverse_cdf(0.5 + 0.5 * CONFIDENCE);
        let z2n = z * z / n;
        let center = (p + 0.5 * z2n) / (1.0 + z2n);
        let half_width = z * (p * (1.0 - p) / n + 0.25 * z2n / n).sqrt() / (1.0 + z2n);
        Ok(Self { value: p, low: center - half_width, high: center + half_width })
    }
}

/// The number of resamples of a bootstrap.
const RESAMPLES: usize = 2_000;

/// Returns the mean without the lowest and the highest quarter of the numbers, which it sorts; 0 if
/// there are none.
fn interquartile_mean(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let cut = numbers.len() / 4;
    let middle = &numbers[cut..numbers.len() - cut];
    middle.iter().sum::<f64>() / (middle.len() as f64).max(1.0)
}

/// Returns the p-value of Fisher's exact test, two-sided, of whether `a` of `a_total` and `b` of
/// `b_total` are samples of the same share.
#[must_use]
pub fn fisher_exact(a: u64, a_total: u64, b: u64, b_total: u64) -> f64 {
    let table = [a, b, a_total.saturating_sub(a), b_total.saturating_sub(b)];
    if table[..2] == [0, 0] || table[2..] == [0, 0] {
        return 1.0; // all alike
    }
    fishers_exact(&table, Alternative::TwoSided).unwrap_or(1.0)
}

/// Returns the statistic of the two-sample Kolmogorov-Smirnov test, which is the largest difference
/// between the two samples' distribution functions, and its asymptotic p-value. Empty samples do not
/// differ.
///
/// Source: W. H. Press et al., "Numerical Recipes", 3rd edition (2007), section 14.3.3.
#[must_use]
pub fn kolmogorov_smirnov(a: &[f64], b: &[f64]) -> (f64, f64) {
    let sorted = |sample: &[f64]| {
        let mut sample = sample.to_vec();
        sample.sort_by(f64::total_cmp);
        sample
    };
    let (a, b) = (sorted(a), sorted(b));
    let share = |sample: &[f64], x: f64| {
        sample.partition_point(|value| *value <= x) as f64 / sample.len().max(1) as f64
    };
    let differences = a.iter().chain(&b).map(|&x| (share(&a, x) - share(&b, x)).abs());
    let statistic = differences.fold(0.0, f64::max);
    let (n, m) = (a.len() as f64, b.len() as f64);
    let root = (n * m / (n + m)).sqrt();
    let lambda = (root + 0.12 + 0.11 / root) * statistic;
    if lambda < 0.2 {
        return (statistic, 1.0); // to 12 digits; the series below does not converge there
    }
    let terms = (1..=100).map(|k| {
        let k = f64::from(k);
        let sign = if k % 2.0 == 1.0 { 2.0 } else { -2.0 };
        sign * (-2.0 * k * k * lambda * lambda).exp()
    });
    (statistic, terms.sum::<f64>().clamp(0.0, 1.0))
}

/// Tests by chi-square whether two samples, counted by category, come from the same distribution.
/// Returns the statistic per degree of freedom, which is about 1 if they do, and the p-value. The
/// smallest categories are merged until each expects at least 5 of either sample.
///
/// Source: W. G. Cochran, "Some methods for strengthening the common chi-square tests", Biometrics 10
/// (1954), for the 5.
#[must_use]
pub fn chi_square(a: &[u64], b: &[u64]) -> (f64, f64) {
    const LEAST_EXPECTED: f64 = 5.0;
    let total = |counts: &[u64]| counts.iter().sum::<u64>() as f64;
    let (a_share, b_share) = (total(a) / (total(a) + total(b)), total(b) / (total(a) + total(b)));
    let mut categories: Vec<_> = a.iter().zip(b).map(|(a, b)| (*a as f64, *b as f64)).collect();
    categories.retain(|(a, b)| a + b > 0.0);
    categories.sort_by(|x, y| (y.0 + y.1).total_cmp(&(x.0 + x.1)));
    let is_small = |(a, b): &(f64, f64)| (a + b) * a_share.min(b_share) < LEAST_EXPECTED;
    while categories.len() > 1 && categories.last().is_some_and(is_small) {
        let last = categories.pop().unwrap_or_default();
        if let Some(before) = categories.last_mut() {
            *before = (before.0 + last.0, before.1 + last.1);
        }
    }
    let terms = categories.iter().map(|(a, b)| {
        let (a_expected, b_expected) = ((a + b) * a_share, (a + b) * b_share);
        (a - a_expected).powi(2) / a_expected + (b - b_expected).powi(2) / b_expected
    });
    let statistic = terms.sum::<f64>();
    let freedom = categories.len().saturating_sub(1) as f64;
    // Without a degree of freedom the samples cannot differ.
    ChiSquared::new(freedom)
        .map_or((0.0, 1.0), |distribution| (statistic / freedom, distribution.sf(statistic)))
}
