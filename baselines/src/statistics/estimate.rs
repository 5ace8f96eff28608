//! Estimates with confidence intervals.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use super::error::{StatisticsError, check_finite, check_successes};

/// An estimate with its 95 % confidence interval.
///
/// It is serialized with `null` for an unbounded end.
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
    /// [`StatisticsError::Empty`], [`StatisticsError::NotFinite`], and
    /// [`StatisticsError::TooFarApart`] if an end of the interval exceeds the largest number.
    pub fn mean(sample: &[f64]) -> Result<Self, StatisticsError> {
        check_finite(sample)?;
        let (sample, unit) = scaled(sample);
        let count = sample.len() as f64;
        let value = mean(&sample);
        let variance = sample.iter().map(|x| (x - value).powi(2)).sum::<f64>() / (count - 1.0);
        let half_width = match StudentsT::new(0.0, 1.0, count - 1.0) {
            Ok(student) => student.inverse_cdf(0.5 + 0.5 * CONFIDENCE) * (variance / count).sqrt(),
            Err(_) => f64::INFINITY, // one value, no degree of freedom
        };
        let [low, high] = [value - half_width, value + half_width];
        let is_bounded = half_width.is_finite();
        let [value, low, high] = [value, low, high].map(|number| number * unit);
        if is_bounded && !(low.is_finite() && high.is_finite()) {
            return Err(StatisticsError::TooFarApart);
        }
        Ok(Self { value, low, high })
    }

    /// Returns the interquartile mean of a sample, its mean without the lowest and the highest
    /// quarter, with the percentile interval of a bootstrap. `seed` decides the resamples.
    ///
    /// Source: Agarwal et al., "Deep reinforcement learning at the edge of the statistical
    /// precipice", NeurIPS (2021), for the runs of one task.
    ///
    /// # Errors
    /// [`StatisticsError::Empty`] and [`StatisticsError::NotFinite`].
    pub fn interquartile_mean(sample: &[f64], seed: u64) -> Result<Self, StatisticsError> {
        check_finite(sample)?;
        let (sample, unit) = scaled(sample);
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
            value: unit * interquartile_mean(&mut sample.to_vec()),
            low: unit * quantile(0.5 - 0.5 * CONFIDENCE),
            high: unit * quantile(0.5 + 0.5 * CONFIDENCE),
        })
    }

    /// Returns a share of successes with Wilson's interval, which stays within 0 and 1.
    ///
    /// Source: E. B. Wilson, "Probable inference, the law of succession, and statistical
    /// inference", JASA 22 (1927).
    ///
    /// # Errors
    /// [`StatisticsError::Empty`] if `count` is 0, and
    /// [`StatisticsError::MoreSuccesses`] than `count`.
    pub fn share(successes: usize, count: usize) -> Result<Self, StatisticsError> {
        check_successes(successes as u64, count as u64)?;
        let n = count as f64;
        let p = successes as f64 / n;
        let z = Normal::standard().inverse_cdf(0.5 + 0.5 * CONFIDENCE);
        let z2n = z * z / n;
        let center = (p + 0.5 * z2n) / (1.0 + z2n);
        let half_width = z * (p * (1.0 - p) / n + 0.25 * z2n / n).sqrt() / (1.0 + z2n);
        // Rounding would move ends of 0 and 1 slightly off.
        let low = if successes == 0 { 0.0 } else { (center - half_width).clamp(0.0, p) };
        let high = if successes == count { 1.0 } else { (center + half_width).clamp(p, 1.0) };
        Ok(Self { value: p, low, high })
    }
}

/// Returns a sample divided by a unit near its largest value, and the unit, which is a power of
/// two, so no digit changes. The sums of such numbers and of their squares do not overflow.
fn scaled(sample: &[f64]) -> (Vec<f64>, f64) {
    /// The largest exponent for which two to its power and one over that have full precision.
    const MOST: i32 = 1022;
    let largest = sample.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    let exponent = (largest.log2().floor() as i32).clamp(-MOST, MOST);
    (sample.iter().map(|value| value * 2_f64.powi(-exponent)).collect(), 2_f64.powi(exponent))
}

/// The number of resamples of a bootstrap.
const RESAMPLES: usize = 2_000;

/// Returns the mean without the lowest and the highest quarter of the numbers, which it sorts; 0 if
/// there are none.
fn interquartile_mean(numbers: &mut [f64]) -> f64 {
    numbers.sort_by(f64::total_cmp);
    let cut = numbers.len() / 4;
    mean(&numbers[cut..numbers.len() - cut])
}

/// Returns the mean of numbers, kept between the least and the greatest of them despite rounding; 0
/// if there are none.
fn mean(numbers: &[f64]) -> f64 {
    let mean = numbers.iter().sum::<f64>() / (numbers.len() as f64).max(1.0);
    let least = numbers.iter().copied().reduce(f64::min).unwrap_or_default();
    let greatest = numbers.iter().copied().reduce(f64::max).unwrap_or_default();
    mean.max(least).min(greatest)
}
