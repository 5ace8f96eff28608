//! The running normalizer: its numbers, its errors, saving and loading.

use her_relabel::{Normalizer, NormalizerConfig, NormalizerError};
use proptest::prelude::*;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const DIM: usize = 3;
const CONFIG: NormalizerConfig = NormalizerConfig::new(DIM);
const SINGLE: NormalizerConfig = NormalizerConfig::new(1);

fn rows() -> impl Strategy<Value = Vec<f64>> {
    let value = (-1e3..1e3_f64, 0..4_u8).prop_map(|(x, far)| x + 1e6 * f64::from(far / 3));
    (0..40_usize).prop_flat_map(move |n| prop::collection::vec(value.clone(), n * DIM))
}

fn normalizer(config: NormalizerConfig, rows: &[f64]) -> Result<Normalizer, NormalizerError> {
    let mut normalizer = Normalizer::new(config)?;
    normalizer.update(rows)?;
    Ok(normalizer)
}

/// Asserts equality up to rounding.
fn assert_close(a: &Normalizer, b: &Normalizer) {
    assert_eq!(a.count(), b.count());
    let values = a.mean().iter().copied().zip(b.mean().iter().copied()).chain(a.std().zip(b.std()));
    for (a, b) in values {
        assert!((a - b).abs() <= 1e-9 * (1.0 + a.abs()), "{a} {b}");
    }
}

proptest! {
    #[test]
    fn a_merge_is_one_pass(a in rows(), b in rows(), c in rows()) {
        let all = normalizer(CONFIG, &[&a[..], &b, &c].concat())?;
        let mut left = normalizer(CONFIG, &a)?;
        left.merge(&normalizer(CONFIG, &b)?)?;
        left.merge(&normalizer(CONFIG, &c)?)?;
        assert_close(&left, &all);
        let mut right = normalizer(CONFIG, &b)?;
        right.merge(&normalizer(CONFIG, &c)?)?;
        let mut other = normalizer(CONFIG, &a)?;
        other.merge(&right)?;
        assert_close(&other, &all);
        // Also row by row.
        let mut single = Normalizer::new(CONFIG)?;
        for row in [&a[..], &b, &c].concat().chunks_exact(DIM) {
            single.update(row)?;
        }
        assert_close(&single, &all);
    }

    #[test]
    fn normalized_rows_have_mean_0_and_deviation_1(rows in rows()) {
        prop_assume!(rows.len() >= 2 * DIM);
        let config = CONFIG.with_clip(1e9);
        let before = normalizer(config, &rows)?;
        let mut normalized = rows.clone();
        before.normalize(&mut normalized)?;
        let after = normalizer(config, &normalized)?;
        for ((mean, std), before) in after.mean().iter().zip(after.std()).zip(before.std()) {
            prop_assert!(mean.abs() < 1e-6);
            prop_assert!(before == 0.01 || (std - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_was_saved_is_loaded(rows in rows()) {
        let normalizer = normalizer(CONFIG, &rows)?;
        let text = serde_json::to_string(&normalizer)?;
        prop_assert_eq!(serde_json::from_str::<Normalizer>(&text)?, normalizer);
    }
}

#[test]
fn the_numbers_are_those_of_the_formulas() -> Result {
    let mut normalizer = Normalizer::new(SINGLE)?;
    let mut untouched = [7.0];
    normalizer.normalize(&mut untouched)?;
    assert_eq!(untouched, [5.0], "mean 0, deviation 1, clipped to 5");
    normalizer.update(&[1.0_f32, 2.0, 3.0, 4.0])?;
    assert_eq!((normalizer.count(), normalizer.dim()), (4, 1));
    assert_eq!(normalizer.mean(), [2.5]);
    assert_eq!(normalizer.std().next(), Some(1.25_f64.sqrt()));
    let mut rows = [2.5_f32 + 1.25_f32.sqrt(), -100.0, 100.0];
    normalizer.normalize(&mut rows)?;
    assert!((rows[0] - 1.0).abs() < 1e-6);
    assert_eq!(rows[1..], [-5.0, 5.0]);
    Ok(())
}

#[test]
fn what_hardly_varies_is_not_inflated() -> Result {
    let normalizer = normalizer(SINGLE, &[1.0, 1.0, 1.0])?;
    let mut row = [1.001];
    normalizer.normalize(&mut row)?;
    assert!((row[0] - 0.1_f64).abs() < 1e-9, "{row:?}: divided by the smallest deviation, 0.01");
    Ok(())
}

/// Sums of squares alone would have lost all digits.
#[test]
fn a_large_mean_costs_no_digits() -> Result {
    let mut normalizer = Normalizer::new(SINGLE)?;
    for value in [-1.0, 1.0, -1.0, 1.0] {
        normalizer.update(&[1e9 + value])?;
    }
    assert!(normalizer.std().all(|std| (std - 1.0).abs() < 1e-6));
    Ok(())
}

#[test]
fn errors_leave_it_as_it_was() -> Result {
    let mut normalizer = normalizer(CONFIG, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0])?;
    let before = normalizer.clone();
    let wrong = NormalizerError::WrongLength { len: 4, dim: DIM };
    assert_eq!(normalizer.update(&[0.0; 4]), Err(wrong.clone()));
    assert_eq!(normalizer.normalize(&mut [0.0; 4]), Err(wrong));
    let mut row = [0.0, f64::INFINITY, 0.0];
    let infinite = NormalizerError::NotFinite { index: 1, value: f64::INFINITY };
    assert_eq!(normalizer.update(&row), Err(infinite.clone()));
    assert_eq!(normalizer.normalize(&mut row), Err(infinite));
    assert_eq!(normalizer.update(&[1e200; DIM]), Err(NormalizerError::TooLarge));
    let other = Normalizer::new(NormalizerConfig::new(2))?;
    assert_eq!(normalizer.merge(&other), Err(NormalizerError::WrongLength { len: 2, dim: DIM }));
    assert_eq!(normalizer, before);
    assert_eq!(Normalizer::new(NormalizerConfig::new(0)), Err(NormalizerError::Empty));
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(Normalizer::new(CONFIG.with_min_std(bad)).is_err());
        assert!(Normalizer::new(CONFIG.with_clip(bad)).is_err());
    }
    Ok(())
}

#[test]
fn damaged_numbers_are_not_loaded() -> Result {
    let good = serde_json::to_string(&normalizer(CONFIG, &[1.0, 2.0, 3.0])?)?;
    for (part, damaged) in [
        ("\"count\":1", "\"count\":0"),
        ("[1.0,2.0,3.0]", "[1.0,2.0]"),
        ("[1.0,2.0,3.0]", "[]"),
        ("[0.0,0.0,0.0]", "[0.0,-1.0,0.0]"),
        ("\"clip\":5.0", "\"clip\":0.0"),
    ] {
        let text = good.replace(part, damaged);
        assert_ne!(text, good, "{part}");
        assert!(serde_json::from_str::<Normalizer>(&text).is_err(), "{text}");
    }
    Ok(())
}
