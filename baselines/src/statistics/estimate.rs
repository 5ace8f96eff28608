//! Estimates with confidence intervals.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::error::{StatisticsError as Error, check_finite, check_successes};

/// An estimate with its 95 % confidence interval.
///
/// It is serialized with `null` for an end that is not bounded.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "Bounded", into = "Bounded")]
pub struct Estimate {
    /// The estimate itself.
    pub value: f64,
    /// Lower end of the interval; negative infinity if it is not bounded.
    pub low: f64,
    /// Upper end of the interval; infinity if it is not bounded.
    pub high: f64,
}

/// An [`Estimate`] as it is serialized: JSON has no infinity.
#[derive(Serialize, Deserialize)]
struct Bounded {
    value: f64,
    low: Option<f64>,
    high: Option<f64>,
}

impl From<Estimate> for Bounded {
    fn from(Estimate { value, low, high }: Estimate) -> Self {
        let bound = |end: f64| end.is_finite().then_some(end);
        Self { value, low: bound(low), high: bound(high) }
    }
}

impl From<Bounded> for Estimate {
    fn from(Bounded { value, low, high }: Bounded) -> Self {
        Self { value, low: low.unwrap_or(f64::NEG_INFINITY), high: high.unwrap_or(f64::INFINITY) }
    }
}

const CONFIDENCE: f64 = 0.95;

impl Estimate {
    /// Returns the mean of a sample with Student's interval, which is unbounded for a single value.
    ///
    /// # Errors
    /// [`StatisticsError::Empty`](Error::Empty) and [`StatisticsError::NotFinite`](Error::NotFinite).
    pub fn mean(sample: &[f64]) -> Result<Self, Error> {
        check_finite(sample)?;
        let count = sample.len() as f64;
        let value = sample.iter().sum::<f64>() / count;
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
    /// [`StatisticsError::Empty`](Error::Empty) and [`StatisticsError::NotFinite`](Error::NotFinite).
    pub fn interquartile_mean(sample: &[f64], seed: u64) -> Result<Self, Error> {
        check_finite(sample)?;
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
    /// [`StatisticsError::Empty`](Error::Empty) if `count` is 0, and
    /// [`StatisticsError::MoreSuccesses`](Error::MoreSuccesses) than `count`.
    pub fn share(successes: usize, count: usize) -> Result<Self, Error> {
        check_successes(successes as u64, count as u64)?;
        let n = count as f64;
        let p = successes as f64 / n;
        let z = Normal::standard().inverse_cdf(0.5 + 0.5 * CONFIDENCE);
        let z2n = z * z / n;
        let center = (p + 0.5 * z2n) / (1.0 + z2n);
        let half_width = z * (p * (1.0 - p) / n + 0.25 * z2n / n).sqrt() / (1.0 + z2n);
        // Rounding would put the ends of 0 and 1 beside them.
        let low = if successes == 0 { 0.0 } else { (center - half_width).clamp(0.0, p) };
        let high = if successes == count { 1.0 } else { (center + half_width).clamp(p, 1.0) };
        Ok(Self { value: p, low, high })
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
