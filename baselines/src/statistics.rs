use serde::{Deserialize, Serialize};
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

use crate::EvaluationError;

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
    /// The mean of a sample, with Student's interval: unbounded for a single value.
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

    /// A share of successes, with Wilson's interval, which stays within 0 and 1.
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
        let centre = (p + 0.5 * z2n) / (1.0 + z2n);
        let half_width = z * (p * (1.0 - p) / n + 0.25 * z2n / n).sqrt() / (1.0 + z2n);
        Ok(Self { value: p, low: centre - half_width, high: centre + half_width })
    }
}

#[cfg(test)]
mod tests {
    use super::Estimate;

    #[test]
    fn the_interval_of_a_mean_is_students() {
        // t of 0.975 with 4 degrees of freedom is 2.776445; the sample's sd is sqrt(2.5).
        let estimate = Estimate::mean(&[1.0, 2.0, 3.0, 4.0, 5.0]).unwrap();
        let half_width = 2.776_445 * (2.5_f64 / 5.0).sqrt();
        assert_eq!(estimate.value, 3.0);
        assert!((estimate.high - 3.0 - half_width).abs() < 1e-5);
        assert!((3.0 - estimate.low - half_width).abs() < 1e-5);
    }

    #[test]
    fn the_interval_of_a_share_is_wilsons() {
        // Newcombe (1998), table I: 81 of 263 has the interval 0.2553 to 0.3662.
        let estimate = Estimate::share(81, 263).unwrap();
        assert!((estimate.low - 0.2553).abs() < 5e-5 && (estimate.high - 0.3662).abs() < 5e-5);
        let none = Estimate::share(0, 10).unwrap();
        assert!(none.low.abs() < 1e-12 && none.high > 0.2);
    }

    #[test]
    fn small_samples() {
        assert!(Estimate::mean(&[]).is_err());
        assert!(Estimate::share(0, 0).is_err());
        assert_eq!(Estimate::mean(&[2.0]).unwrap().high, f64::INFINITY);
    }
}
