//! Estimates and tests of two samples against the literature and other implementations.

use baselines::{Estimate, EvaluationError, chi_square, fisher_exact, kolmogorov_smirnov};

#[test]
fn the_interval_of_a_mean_is_students() -> Result<(), EvaluationError> {
    // t of 0.975 with 4 degrees of freedom is 2.776445; the sample's sd is sqrt(2.5).
    let estimate = Estimate::mean(&[1.0, 2.0, 3.0, 4.0, 5.0])?;
    let half_width = 2.776_445 * (2.5_f64 / 5.0).sqrt();
    assert_eq!(estimate.value, 3.0);
    assert!((estimate.high - 3.0 - half_width).abs() < 1e-5);
    assert!((3.0 - estimate.low - half_width).abs() < 1e-5);
    Ok(())
}

#[test]
fn the_interval_of_a_share_is_wilsons() -> Result<(), EvaluationError> {
    // Newcombe (1998), table I: 81 of 263 has the interval 0.2553 to 0.3662.
    let estimate = Estimate::share(81, 263)?;
    assert!((estimate.low - 0.2553).abs() < 5e-5 && (estimate.high - 0.3662).abs() < 5e-5);
    let none = Estimate::share(0, 10)?;
    assert!(none.low.abs() < 1e-12 && none.high > 0.2);
    Ok(())
}

#[test]
fn the_interquartile_mean_leaves_the_tails_out() -> Result<(), EvaluationError> {
    // scipy.stats.trim_mean of the ten numbers, 0.25 of each end, leaves 3 to 8.
    let sample = [1.0, 8.0, 3.0, 900.0, 5.0, 6.0, 7.0, 2.0, 9.0, 4.0];
    let estimate = Estimate::interquartile_mean(&sample, 0)?;
    assert_eq!(estimate.value, 5.5);
    assert!(estimate.low < 4.5 && (6.5..900.0).contains(&estimate.high), "{estimate:?}");
    assert_eq!(Estimate::interquartile_mean(&sample, 0)?, estimate);
    assert_eq!(Estimate::interquartile_mean(&[0.5], 1)?.high, 0.5);
    assert!(Estimate::interquartile_mean(&[], 0).is_err());
    Ok(())
}

#[test]
fn small_samples() -> Result<(), EvaluationError> {
    assert!(Estimate::mean(&[]).is_err());
    assert!(Estimate::share(0, 0).is_err());
    assert_eq!(Estimate::mean(&[2.0])?.high, f64::INFINITY);
    Ok(())
}

#[test]
fn fishers_test_is_the_tea_tasters() {
    // 3 of 4 against 1 of 4.
    assert!((fisher_exact(3, 4, 1, 4) - 0.485_714).abs() < 1e-6);
    assert!(fisher_exact(40, 100, 0, 400) < 1e-20);
    assert_eq!(fisher_exact(0, 100, 0, 400), 1.0);
}

#[test]
fn the_kolmogorov_smirnov_test_is_scipys() {
    let a: Vec<f64> = (0..50).map(|i| f64::from(i * i % 97)).collect();
    let b: Vec<f64> = (0..80).map(|i| f64::from(i * 7 % 60)).collect();
    let (statistic, p) = kolmogorov_smirnov(&a, &b);
    assert!((statistic - 0.42).abs() < 1e-12, "{statistic}");
    assert!((p - 1.798e-5).abs() < 1e-5, "{p}");
    assert_eq!(kolmogorov_smirnov(&a, &a), (0.0, 1.0));
}

#[test]
fn the_chi_square_test_is_the_formula() {
    // By hand: 10 of each row expected to be 15, 20 of each to be 15.
    let (statistic, p) = chi_square(&[10, 20], &[20, 10]);
    assert!((statistic - 20.0 / 3.0).abs() < 1e-12, "{statistic}");
    assert!((p - 0.009_823).abs() < 1e-6, "{p}");
    assert_eq!(chi_square(&[10, 20], &[10, 20]).1, 1.0);
    // Nothing to tell apart: one category, or too few of each.
    assert_eq!(chi_square(&[10, 0], &[20, 0]), (0.0, 1.0));
    assert_eq!(chi_square(&[1, 2], &[2, 1]), (0.0, 1.0));
}
