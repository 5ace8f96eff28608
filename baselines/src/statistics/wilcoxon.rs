//! Wilcoxon's signed-rank test.

use statrs::distribution::{ContinuousCDF, Normal};

use super::error::{StatisticsError, check_finite, check_lengths};

/// Tests by Wilcoxon's signed ranks whether pairs of values, such as those of the same episodes,
/// differ by chance alone: whether their differences are as often and as far above 0 as below.
/// Returns the sum of the ranks of positive differences and the two-sided p-value: the exact one
/// for up to 50 pairs that differ, and the normal approximation for more. Pairs that do not differ
/// are left out.
///
/// Source: F. Wilcoxon, "Individual comparisons by ranking methods", Biometrics Bulletin 1 (1945).
///
/// # Errors
/// [`StatisticsError::Lengths`], [`StatisticsError::Empty`] and [`StatisticsError::NotFinite`].
pub fn wilcoxon(a: &[f64], b: &[f64]) -> Result<(f64, f64), StatisticsError> {
    check_lengths(a.len(), b.len())?;
    check_finite(a)?;
    check_finite(b)?;
    // The differences of halves do not overflow, and have the same ranks.
    let is_large = a.iter().chain(b).any(|value| value.abs() > 0.5 * f64::MAX);
    let unit = if is_large { 0.5 } else { 1.0 };
    let mut differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| unit * a - unit * b).collect();
    differences.retain(|difference| *difference != 0.0);
    differences.sort_by(|x, y| x.abs().total_cmp(&y.abs()));
    let ranks = doubled_ranks(&differences);
    let positive: u64 = ranks
        .iter()
        .zip(&differences)
        .filter(|(_, difference)| **difference > 0.0)
        .map(|(rank, _)| rank)
        .sum();
    let p_value =
        if ranks.len() <= MOST_EXACT { exact(&ranks, positive) } else { normal(&ranks, positive) };
    Ok((0.5 * positive as f64, p_value))
}

/// The number of differences up to which all their signs are counted.
const MOST_EXACT: usize = 50;

/// Returns the ranks of sorted differences, times 2: equal ones share the mean of their ranks.
fn doubled_ranks(differences: &[f64]) -> Vec<u64> {
    let mut ranks = Vec::with_capacity(differences.len());
    for equal in differences.chunk_by(|x, y| x.abs() == y.abs()) {
        let before = ranks.len() as u64;
        ranks.extend(vec![2 * before + equal.len() as u64 + 1; equal.len()]);
    }
    ranks
}

/// Returns the share of all choices of signs whose sum of positive ranks is at least as far from
/// the middle as `positive`.
fn exact(ranks: &[u64], positive: u64) -> f64 {
    let total: u64 = ranks.iter().sum();
    // The share of the signs so far that have each sum.
    let mut shares = vec![0.0; total as usize + 1];
    shares[0] = 1.0;
    for rank in ranks {
        for sum in (0..shares.len()).rev() {
            let before = sum.checked_sub(*rank as usize).map_or(0.0, |before| shares[before]);
            shares[sum] = 0.5 * (shares[sum] + before);
        }
    }
    let distance = |sum: u64| (2 * sum).abs_diff(total);
    let far = (0..).zip(&shares).filter(|(sum, _)| distance(*sum) >= distance(positive));
    far.map(|(_, share)| share).sum::<f64>().min(1.0)
}

/// Returns the normal approximation, with half a rank for continuity.
fn normal(ranks: &[u64], positive: u64) -> f64 {
    let mean = 0.25 * ranks.iter().sum::<u64>() as f64;
    let variance = ranks.iter().map(|rank| (0.5 * *rank as f64).powi(2)).sum::<f64>() / 4.0;
    let distance = (0.5 * positive as f64 - mean).abs() - 0.5;
    (2.0 * Normal::standard().sf(distance.max(0.0) / variance.sqrt())).min(1.0)
}
