//! Fisher's exact test.

use statrs::function::factorial::ln_binomial;

use super::error::{StatisticsError, check_successes};

/// Returns the two-sided p-value of Fisher's exact test of whether `a` successes in `a_total`
/// trials and `b` in `b_total` come from the same success rate: the probability of all tables that
/// are no more probable than the observed one.
///
/// Source: R. A. Fisher, "On the interpretation of chi-square from contingency tables, and the
/// calculation of P", Journal of the Royal Statistical Society 85 (1922).
///
/// # Errors
/// [`StatisticsError::Empty`] without trials, [`StatisticsError::MoreSuccesses`] for more than trials, and
/// [`StatisticsError::TooManyTrials`] for more than a million trials of both samples together.
pub fn fisher_exact(a: u64, a_total: u64, b: u64, b_total: u64) -> Result<f64, StatisticsError> {
    check_successes(a, a_total)?;
    check_successes(b, b_total)?;
    if a_total.saturating_add(b_total) > MOST_TRIALS {
        return Err(StatisticsError::TooManyTrials { most: MOST_TRIALS });
    }
    // The weights of the hypergeometric distribution, up to a factor that all tables share.
    // Logarithms of factorials do not overflow.
    let successes = a + b;
    let log_weight = |a: u64| ln_binomial(a_total, a) + ln_binomial(b_total, successes - a);
    let log_observed = log_weight(a);
    let (mut all, mut extreme) = (0.0, 0.0);
    let most_probable = successes as f64 * a_total as f64 / (a_total + b_total) as f64;
    let log_greatest = log_weight(
        (most_probable as u64).clamp(successes.saturating_sub(b_total), successes.min(a_total)),
    );
    for a in successes.saturating_sub(b_total)..=successes.min(a_total) {
        let log_weight = log_weight(a);
        all += (log_weight - log_greatest).exp();
        if log_weight <= log_observed + TOLERANCE {
            extreme += (log_weight - log_observed).exp();
        }
    }
    Ok((extreme / all * (log_observed - log_greatest).exp()).min(1.0))
}

/// The number of trials up to which all tables are summed, in less than a second.
const MOST_TRIALS: u64 = 1_000_000;

/// The difference of logarithms up to which two tables count as equally probable, because of
/// rounding; the same as in R's `fisher.test`.
const TOLERANCE: f64 = 1e-7;
