//! Estimates with their intervals, against the literature and other implementations.

use baselines::{Estimate, StatisticsError};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

#[test]
fn the_interval_of_a_mean_is_students() -> Result<(), StatisticsError> {
    // t of 0.975 with 4 degrees of freedom is 2.776445; the sample's sd is sqrt(2.5).
    let estimate = Estimate::mean(&[1.0, 2.0, 3.0, 4.0, 5.0])?;
    let half_width = 2.776_445 * (2.5_f64 / 5.0).sqrt();
    assert_eq!(estimate.value, 3.0);
    assert!((estimate.high - 3.0 - half_width).abs() < 1e-5);
    assert!((3.0 - estimate.low - half_width).abs() < 1e-5);
    Ok(())
}

#[test]
fn the_interval_of_a_share_is_wilsons() -> Result<(), StatisticsError> {
    // Newcombe (1998), table I: 81 of 263 has the interval 0.2553 to 0.3662.
    let estimate = Estimate::share(81, 263)?;
    assert!((estimate.low - 0.2553).abs() < 5e-5 && (estimate.high - 0.3662).abs() < 5e-5);
    let none = Estimate::share(0, 10)?;
    assert!(none.low == 0.0 && none.high > 0.2);
    assert_eq!(Estimate::share(10, 10)?.high, 1.0);
    Ok(())
}

/// Both intervals are those of scipy 1.17.1: `t.interval`, and `binomtest(k, n).proportion_ci` by
/// Wilson.
#[test]
fn intervals_are_scipys() -> Result<(), StatisticsError> {
    let estimate = Estimate::mean(&[0.5, -1.25, 7.0, 3.5, 2.0, 9.75, -4.0])?;
    assert_eq!(estimate.value, 2.5);
    assert!((estimate.low + 1.876_761_865_584).abs() < 1e-9, "{estimate:?}");
    assert!((estimate.high - 6.876_761_865_584).abs() < 1e-9, "{estimate:?}");
    for (successes, count, low, high) in [
        (0, 10, 0.0, 0.277_532_799_862_9),
        (1, 3, 0.061_491_944_720_4, 0.792_340_399_198),
        (1, 1, 0.206_549_314_377_2, 1.0),
        (29, 30, 0.833_296_090_085_9, 0.994_091_409_618_4),
        (7, 1_000_000, 3.390_867_834_9e-6, 1.445_052_244_882_7e-5),
    ] {
        let estimate = Estimate::share(successes, count)?;
        assert_eq!(estimate.value, successes as f64 / count as f64);
        assert!((estimate.low - low).abs() <= 1e-9 * low, "{successes} of {count}: {estimate:?}");
        assert!((estimate.high / high - 1.0).abs() < 1e-9, "{successes} of {count}: {estimate:?}");
    }
    Ok(())
}

proptest! {
    /// The ends are 0 and 1 for none and all, and rounding puts none beyond the estimate.
    #[test]
    fn the_interval_of_a_share_is_symmetric(count in 1_usize..2_000, successes in 0_usize..2_000) {
        let successes = successes % (count + 1);
        let Estimate { value, low, high } = Estimate::share(successes, count)?;
        prop_assert!(0.0 <= low && low <= value && value <= high && high <= 1.0);
        prop_assert!((low == 0.0) == (successes == 0) && (high == 1.0) == (successes == count));
        let failures = Estimate::share(count - successes, count)?;
        prop_assert!((low + failures.high - 1.0).abs() < 1e-12);
    }
}

/// The resamples are drawn here again, and the mean is scipy's `trim_mean`.
#[test]
fn the_interval_of_an_interquartile_mean_is_a_bootstraps() -> Result<(), StatisticsError> {
    for (count, mean) in [(41, 92.550_915_606_746), (6, 141.743_609_084_182)] {
        let sample: Vec<_> = (0..count).map(|x| f64::from(x * 37 % 41).powf(1.5)).collect();
        let trimmed = |numbers: &[f64]| {
            let mut numbers = numbers.to_vec();
            numbers.sort_by(f64::total_cmp);
            let middle = &numbers[numbers.len() / 4..numbers.len() - numbers.len() / 4];
            middle.iter().sum::<f64>() / middle.len() as f64
        };
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let mut means: Vec<_> = (0..2_000)
            .map(|_| {
                let draws = sample.iter().map(|_| sample[rng.random_range(0..sample.len())]);
                trimmed(&draws.collect::<Vec<_>>())
            })
            .collect();
        means.sort_by(f64::total_cmp);
        let estimate = Estimate::interquartile_mean(&sample, 5)?;
        assert!((estimate.value - mean).abs() < 1e-9, "{estimate:?}");
        // 2.5 % and 97.5 % of the way from the first to the last.
        assert_eq!((estimate.low, estimate.high), (means[50], means[1_949]));
    }
    Ok(())
}

#[test]
fn numbers_of_any_size_have_the_estimates_of_ordinary_ones() -> Result<(), StatisticsError> {
    let sample = [1.0, 2.5, -0.75, 1.875];
    let tiny = 2_f64.powi(-1000);
    for unit in [2_f64.powi(1020), tiny, 2_f64.powi(-700)] {
        let scaled = sample.map(|value| unit * value);
        let of = |estimate: Estimate| {
            [estimate.value, estimate.low, estimate.high].map(|number| unit * number)
        };
        let found = Estimate::mean(&scaled)?;
        assert_eq!([found.value, found.low, found.high], of(Estimate::mean(&sample)?));
        let found = Estimate::interquartile_mean(&scaled, 3)?;
        let expected = of(Estimate::interquartile_mean(&sample, 3)?);
        assert_eq!([found.value, found.low, found.high], expected);
    }
    for value in [1e308, f64::MAX, -f64::MAX, f64::MIN_POSITIVE, 5e-324, 0.0, 0.1] {
        for count in 2..8 {
            let alike = Estimate { value, low: value, high: value };
            assert_eq!(Estimate::mean(&vec![value; count])?, alike);
            assert_eq!(Estimate::interquartile_mean(&vec![value; count], 0)?, alike);
        }
        assert_eq!(Estimate::mean(&[value])?.value, value);
    }
    // The interval of these has no finite ends.
    let far = [f64::MAX, -f64::MAX];
    assert_eq!(Estimate::mean(&far), Err(StatisticsError::TooFarApart));
    assert_eq!(Estimate::interquartile_mean(&far, 0)?.low, -f64::MAX);
    Ok(())
}

#[test]
fn the_interquartile_mean_leaves_the_tails_out() -> Result<(), StatisticsError> {
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
fn small_samples() -> Result<(), StatisticsError> {
    assert_eq!(Estimate::mean(&[]), Err(StatisticsError::Empty));
    assert_eq!(Estimate::share(0, 0), Err(StatisticsError::Empty));
    let more = StatisticsError::MoreSuccesses { successes: 5, trials: 3 };
    assert_eq!(Estimate::share(5, 3), Err(more));
    assert_eq!(Estimate::mean(&[1.0, f64::NAN]), Err(StatisticsError::NotFinite { index: 1 }));
    assert_eq!(Estimate::mean(&[2.0])?.high, f64::INFINITY);
    Ok(())
}

/// An interval without bounds, which JSON has no numbers for.
#[test]
fn an_estimate_is_read_back_from_json() -> Result<(), Box<dyn std::error::Error>> {
    for estimate in [Estimate::mean(&[2.0])?, Estimate::mean(&[2.0, 0.1])?, Estimate::share(1, 3)?]
    {
        let text = serde_json::to_string(&estimate)?;
        assert_eq!(serde_json::from_str::<Estimate>(&text)?, estimate, "{text}");
    }
    Ok(())
}
