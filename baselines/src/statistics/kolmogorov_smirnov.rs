//! The two-sample Kolmogorov-Smirnov test.

use super::error::{StatisticsError, check_finite};

/// Returns the statistic of the two-sample Kolmogorov-Smirnov test, which is the largest difference
/// between the two samples' distribution functions, and its p-value: the exact one for samples
/// whose lengths have a product of up to a million, and the asymptotic one for longer samples. With
/// equal values in both samples, the exact one is an upper bound.
///
/// Sources: J. L. Hodges, "The significance probability of the Smirnov two-sample test", Arkiv för
/// Matematik 3 (1958), for the paths; W. H. Press et al., "Numerical Recipes", 3rd edition (2007),
/// section 14.3.3, for the series.
///
/// # Errors
/// [`StatisticsError::Empty`] and [`StatisticsError::NotFinite`].
pub fn kolmogorov_smirnov(a: &[f64], b: &[f64]) -> Result<(f64, f64), StatisticsError> {
    check_finite(a)?;
    check_finite(b)?;
    let distance = distance(a, b);
    let (n, m) = (a.len(), b.len());
    let statistic = distance as f64 / (n as f64 * m as f64);
    let is_short = n.checked_mul(m).is_some_and(|product| product <= MOST_PATHS);
    let p_value = if is_short { exact(n, m, distance) } else { asymptotic(n, m, statistic) };
    Ok((statistic, p_value))
}

/// The product of two lengths up to which paths are counted.
const MOST_PATHS: usize = 1_000_000;

/// Returns the statistic times both lengths, which is an integer.
fn distance(a: &[f64], b: &[f64]) -> u128 {
    let sorted = |sample: &[f64]| {
        let mut sample = sample.to_vec();
        sample.sort_by(f64::total_cmp);
        sample
    };
    let (a, b) = (sorted(a), sorted(b));
    let rank = |sample: &[f64], x: f64| sample.partition_point(|value| *value <= x) as u128;
    let (n, m) = (a.len() as u128, b.len() as u128);
    let distances = a.iter().chain(&b).map(|&x| (rank(&a, x) * m).abs_diff(rank(&b, x) * n));
    distances.max().unwrap_or_default()
}

/// Returns the share of all orders of the two samples' values, each a path in a grid, that are
/// somewhere at least `distance` from the diagonal.
fn exact(n: usize, m: usize, distance: u128) -> f64 {
    let is_far =
        |i: usize, j: usize| (i as u128 * m as u128).abs_diff(j as u128 * n as u128) >= distance;
    // The share of the paths to each point in a row of the grid that have been far.
    let mut far = vec![0.0; m + 1];
    for i in 0..=n {
        for j in 0..=m {
            far[j] = match (i, j) {
                _ if is_far(i, j) => 1.0,
                (_, 0) => far[0],
                (i, j) => (i as f64 * far[j] + j as f64 * far[j - 1]) / (i + j) as f64,
            };
        }
    }
    far[m]
}

fn asymptotic(n: usize, m: usize, statistic: f64) -> f64 {
    let (n, m) = (n as f64, m as f64);
    let root = (n * m / (n + m)).sqrt();
    let lambda = (root + 0.12 + 0.11 / root) * statistic;
    if lambda < 0.2 {
        return 1.0; // to 12 digits; the series below does not converge there
    }
    let terms = (1..=100).map(|k| {
        let k = f64::from(k);
        let sign = if k % 2.0 == 1.0 { 2.0 } else { -2.0 };
        sign * (-2.0 * k * k * lambda * lambda).exp()
    });
    terms.sum::<f64>().clamp(0.0, 1.0)
}
