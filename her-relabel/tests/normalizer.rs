//! The running normalizer: its numbers, its errors, saving and loading.

use her_relabel::{Normalizer, NormalizerError};
use proptest::prelude::*;

const DIM: usize = 3;

fn rows() -> impl Strategy<Value = Vec<f64>> {
    let value = (-1e3..1e3_f64, 0..4_u8).prop_map(|(x, far)| x + 1e6 * f64::from(far / 3));
    (0..40_usize).prop_flat_map(move |n| prop::collection::vec(value.clone(), n * DIM))
}

fn normalizer(rows: &[f64]) -> Normalizer {
    let mut normalizer = Normalizer::new(DIM).expect("a dimension");
    normalizer.update(rows).expect("rows");
    normalizer
}

/// Equal but for rounding.
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
        let all = normalizer(&[&a[..], &b, &c].concat());
        let mut left = normalizer(&a);
        left.merge(&normalizer(&b)).expect("a merge");
        left.merge(&normalizer(&c)).expect("a merge");
        assert_close(&left, &all);
        let mut right = normalizer(&b);
        right.merge(&normalizer(&c)).expect("a merge");
        let mut other = normalizer(&a);
        other.merge(&right).expect("a merge");
        assert_close(&other, &all);
        // Row by row, too.
        let mut single = Normalizer::new(DIM).expect("a dimension");
        for row in [&a[..], &b, &c].concat().chunks_exact(DIM) {
            single.update(row).expect("a row");
        }
        assert_close(&single, &all);
    }

    #[test]
    fn normalized_rows_have_mean_0_and_deviation_1(rows in rows()) {
        prop_assume!(rows.len() >= 2 * DIM);
        let normalizer = normalizer(&rows).with_clip(1e9).expect("a clip");
        let mut normalized = rows.clone();
        normalizer.normalize(&mut normalized).expect("rows");
        let again = self::normalizer(&normalized);
        for ((mean, std), before) in again.mean().iter().zip(again.std()).zip(normalizer.std()) {
            prop_assert!(mean.abs() < 1e-6);
            prop_assert!(before == 0.01 || (std - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn what_was_saved_is_loaded(rows in rows()) {
        let normalizer = normalizer(&rows);
        let text = serde_json::to_string(&normalizer).expect("text");
        prop_assert_eq!(serde_json::from_str::<Normalizer>(&text).expect("a normalizer"), normalizer);
    }
}

#[test]
fn the_numbers_are_those_of_the_formulas() {
    let mut normalizer = Normalizer::new(1).expect("a dimension");
    let mut untouched = [7.0];
    normalizer.normalize(&mut untouched).expect("a row");
    assert_eq!(untouched, [5.0], "mean 0, deviation 1, clipped to 5");
    normalizer.update(&[1.0_f32, 2.0, 3.0, 4.0]).expect("rows");
    assert_eq!(normalizer.mean(), [2.5]);
    assert_eq!(normalizer.std().next(), Some(1.25_f64.sqrt()));
    let mut rows = [2.5_f32 + 1.25_f32.sqrt(), -100.0, 100.0];
    normalizer.normalize(&mut rows).expect("rows");
    assert!((rows[0] - 1.0).abs() < 1e-6);
    assert_eq!(rows[1..], [-5.0, 5.0]);
}

#[test]
fn what_hardly_varies_is_not_blown_up() {
    let mut normalizer = Normalizer::new(1).expect("a dimension");
    normalizer.update(&[1.0, 1.0, 1.0]).expect("rows");
    let mut row = [1.001];
    normalizer.normalize(&mut row).expect("a row");
    assert!((row[0] - 0.1_f64).abs() < 1e-9, "{row:?}: divided by the least deviation, 0.01");
}

/// The sums of squares alone would have lost all digits.
#[test]
fn a_large_mean_costs_no_digits() {
    let mut normalizer = Normalizer::new(1).expect("a dimension");
    for value in [-1.0, 1.0, -1.0, 1.0] {
        normalizer.update(&[1e9 + value]).expect("a row");
    }
    assert!((normalizer.std().next().expect("an element") - 1.0).abs() < 1e-6);
}

#[test]
fn errors_leave_it_as_it_was() {
    let mut normalizer = normalizer(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let before = normalizer.clone();
    let wrong = NormalizerError::WrongLength { len: 4, dim: DIM };
    assert_eq!(normalizer.update(&[0.0; 4]), Err(wrong.clone()));
    assert_eq!(normalizer.normalize(&mut [0.0; 4]), Err(wrong));
    let mut row = [0.0, f64::INFINITY, 0.0];
    let infinite = NormalizerError::NotFinite { index: 1, value: f64::INFINITY };
    assert_eq!(normalizer.update(&row), Err(infinite.clone()));
    assert_eq!(normalizer.normalize(&mut row), Err(infinite));
    assert_eq!(normalizer.update(&[1e200; DIM]), Err(NormalizerError::TooLarge));
    let other = Normalizer::new(2).expect("a dimension");
    assert_eq!(normalizer.merge(&other), Err(NormalizerError::WrongLength { len: 2, dim: DIM }));
    assert_eq!(normalizer, before);
    assert_eq!(Normalizer::new(0), Err(NormalizerError::Empty));
    for bad in [0.0, -1.0, f64::INFINITY, f64::NAN] {
        assert!(before.clone().with_min_std(bad).is_err());
        assert!(before.clone().with_clip(bad).is_err());
    }
}

#[test]
fn damaged_numbers_are_not_loaded() {
    let good = serde_json::to_string(&normalizer(&[1.0, 2.0, 3.0])).expect("text");
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
}
