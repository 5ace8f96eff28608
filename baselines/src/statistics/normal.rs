//! The test of a standard normal number.

use statrs::function::erf::erfc;

/// Returns the two-sided p-value of `z`: the probability that a standard normal number is at least
/// as far from 0.
#[must_use]
pub fn normal_test(z: f64) -> f64 {
    erfc(z.abs() / std::f64::consts::SQRT_2)
}
