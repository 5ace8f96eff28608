//! The chi-square test of two samples.

use statrs::distribution::{ChiSquared, ContinuousCDF};

use super::error::{StatisticsError, check_lengths};

/// Tests by chi-square whether two samples, counted by category, come from the same distribution.
/// Returns the statistic per degree of freedom, which is about 1 if they do, and the p-value. The
/// smallest categories are merged until each expects at least 5 of either sample.
///
/// Source: W. G. Cochran, "Some methods for strengthening the common chi-square tests", Biometrics
/// 10 (1954), for the 5.
///
/// # Errors
/// [`StatisticsError::Lengths`] if one has more categories, and [`StatisticsError::Empty`] if a sample
/// has no value.
pub fn chi_square(a: &[u64], b: &[u64]) -> Result<(f64, f64), StatisticsError> {
    const LEAST_EXPECTED: f64 = 5.0;
    check_lengths(a.len(), b.len())?;
    let total = |counts: &[u64]| counts.iter().map(|count| *count as f64).sum::<f64>();
    if total(a) == 0.0 || total(b) == 0.0 {
        return Err(StatisticsError::Empty);
    }
    let (a_share, b_share) = (total(a) / (total(a) + total(b)), total(b) / (total(a) + total(b)));
    let mut categories: Vec<_> = a.iter().zip(b).map(|(a, b)| (*a as f64, *b as f64)).collect();
    let size = |(a, b): &(f64, f64)| a + b;
    let sort = |categories: &mut [(f64, f64)]| {
        categories.sort_by(|x, y| size(y).total_cmp(&size(x)));
    };
    sort(&mut categories);
    while let [.., next, smallest] = &mut *categories
        && size(smallest) * a_share.min(b_share) < LEAST_EXPECTED
    {
        *next = (next.0 + smallest.0, next.1 + smallest.1);
        categories.pop();
        sort(&mut categories);
    }
    let terms = categories.iter().map(|(a, b)| {
        let (a_expected, b_expected) = ((a + b) * a_share, (a + b) * b_share);
        (a - a_expected).powi(2) / a_expected + (b - b_expected).powi(2) / b_expected
    });
    let statistic = terms.sum::<f64>();
    let freedom = categories.len().saturating_sub(1) as f64;
    // Without a degree of freedom the samples cannot differ.
    Ok(ChiSquared::new(freedom)
        .map_or((0.0, 1.0), |distribution| (statistic / freedom, distribution.sf(statistic))))
}
