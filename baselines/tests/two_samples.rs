//! Tests of two samples, against other implementations and closed forms.

use baselines::{
    StatisticsError,
    statistics::{chi_square, fisher_exact, kolmogorov_smirnov, normal_test, wilcoxon},
};
use proptest::prelude::*;

type Result<T = ()> = std::result::Result<T, StatisticsError>;

/// Successes and trials of two samples, and the p-value of scipy 1.17.1's
/// `fisher_exact([[a, n - a], [b, m - b]]).pvalue`.
const FISHER: [(u64, u64, u64, u64, f64); 40] = [
    (3, 4, 1, 4, 4.857142857143e-01),
    (10, 1000, 0, 1000, 1.909465165342e-03),
    (507, 1000, 314, 1000, 1.970597689805e-18),
    (200, 1000, 0, 400, 1.372430614403e-32),
    (0, 1030, 1, 1030, 1.000000000000e+00),
    (40, 100, 0, 400, 6.125036693130e-32),
    (5, 10, 5, 10, 1.000000000000e+00),
    (1, 2, 0, 3, 4.000000000000e-01),
    (999, 1000, 1000, 1000, 1.000000000000e+00),
    (500, 1000, 500, 1000, 1.000000000000e+00),
    (520, 1000, 480, 1000, 8.111006057913e-02),
    (0, 5, 5, 5, 7.936507936508e-03),
    (7, 20, 13, 40, 1.000000000000e+00),
    (700, 5000, 500, 5000, 8.463839567101e-10),
    (300, 1000, 301, 1001, 1.000000000000e+00),
    (30000, 100000, 29500, 100000, 1.465743552844e-02),
    (1, 100000, 12, 100000, 3.417016675418e-03),
    (90, 100, 10, 100, 6.699175284224e-33),
    (600, 1000, 200, 1000, 1.163205911981e-76),
    (15, 515, 3, 515, 7.047453506815e-03),
    (250, 2000, 90, 400, 6.236863469077e-07),
    (2, 1029, 9, 1031, 6.472742091383e-02),
    (1, 8, 130, 300, 1.443986942861e-01),
    (3, 3, 60, 75, 1.000000000000e+00),
    (429, 1200, 12, 75, 3.866216615821e-04),
    (49, 75, 3, 3, 5.468215994532e-01),
    (228, 300, 2, 3, 5.640044081854e-01),
    (209, 1200, 5, 8, 5.891817375467e-03),
    (0, 3, 0, 3, 1.000000000000e+00),
    (27, 75, 864, 1200, 4.336763865631e-10),
    (1080, 1200, 1, 3, 2.858636705848e-02),
    (70, 75, 29, 75, 4.659997058167e-13),
    (7, 20, 7, 8, 3.285024154589e-02),
    (13, 20, 0, 3, 6.775832862789e-02),
    (4, 8, 247, 1200, 6.306547754385e-02),
    (1025, 1200, 13, 20, 2.038053110441e-02),
    (97, 300, 621, 1200, 1.495460142468e-09),
    (15, 20, 258, 300, 1.904740718036e-01),
    (4, 75, 245, 300, 2.158745434650e-36),
    (6, 8, 848, 1200, 1.000000000000e+00),
];

#[test]
fn fishers_test_is_scipys() -> Result {
    for (a, n, b, m, expected) in FISHER {
        for p in [fisher_exact(a, n, b, m)?, fisher_exact(b, m, a, n)?] {
            assert!((p / expected - 1.0).abs() < 1e-7, "{a} of {n}, {b} of {m}: {p} {expected}");
        }
    }
    assert_eq!(fisher_exact(0, 0, 1, 2), Err(StatisticsError::Empty));
    let more = StatisticsError::MoreSuccesses { successes: 3, trials: 2 };
    assert_eq!(fisher_exact(1, 2, 3, 2), Err(more));
    Ok(())
}

/// An exact test of more trials would take forever, and their sum overflows.
#[test]
fn an_exact_test_of_too_many_trials_is_refused() -> Result {
    assert!((fisher_exact(1, 500_000, 3, 500_000)? - 0.625).abs() < 1e-5);
    let most = 1_000_000;
    for (a, n, b, m) in [
        (1, 500_000, 3, 500_001),
        (u64::MAX, u64::MAX, u64::MAX, u64::MAX),
        (1 << 40, 1 << 41, 1 << 39, 1 << 41),
    ] {
        assert_eq!(fisher_exact(a, n, b, m), Err(StatisticsError::TooManyTrials { most }));
    }
    Ok(())
}

proptest! {
    /// Swapping the samples, or success and failure, changes nothing.
    #[test]
    fn fishers_test_is_symmetric(
        n in 1_u64..400,
        m in 1_u64..400,
        a in 0_u64..400,
        b in 0_u64..400,
    ) {
        let (a, b) = (a % (n + 1), b % (m + 1));
        let p = fisher_exact(a, n, b, m)?;
        prop_assert!(p > 0.0 && p <= 1.0);
        for other in [fisher_exact(b, m, a, n)?, fisher_exact(n - a, n, m - b, m)?] {
            prop_assert!((other / p - 1.0).abs() < 1e-9);
        }
    }
}

fn numbers(count: u32, number: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..count).map(|index| number(f64::from(index))).collect()
}

/// The p-values are those of scipy 1.17.1's `ks_2samp`, exact.
#[test]
fn the_kolmogorov_smirnov_test_is_scipys() -> Result {
    for (a, b, statistic, p) in [
        (vec![1.0, 2.0], vec![3.0, 4.0], 1.0, 1.0 / 3.0),
        (vec![1.0, 2.0], vec![1.5, 4.0], 0.5, 1.0),
        (vec![1.0], vec![2.0], 1.0, 1.0),
        (numbers(30, |x| x), numbers(30, |x| x + 20.5), 0.7, 2.500_011_831_842e-7),
        (numbers(40, |x| x), numbers(40, |x| x + 100.5), 1.0, 1.860_340_365_604e-23),
        (
            numbers(60, |x| x),
            numbers(70, |x| 0.8 * x + 0.25),
            0.071_428_571_428_571,
            0.991_640_689_819_7,
        ),
    ] {
        let found = kolmogorov_smirnov(&a, &b)?;
        assert!((found.0 - statistic).abs() < 1e-12, "{found:?} {statistic}");
        assert!((found.1 / p - 1.0).abs() < 1e-9, "{found:?} {p}");
    }
    // The longest samples whose paths are counted.
    for (shift, p) in [(20.0, 0.988_333_950_998_3), (40.0, 0.400_633_881_582_6)] {
        let moved = numbers(1_000, |x| x + shift);
        let found = kolmogorov_smirnov(&numbers(1_000, |x| x + 0.1), &moved)?;
        assert!((found.1 / p - 1.0).abs() < 1e-9, "{found:?} {p}");
    }
    let same = numbers(50, |x| x % 7.0);
    assert_eq!(kolmogorov_smirnov(&same, &same)?, (0.0, 1.0));
    assert_eq!(kolmogorov_smirnov(&[], &same), Err(StatisticsError::Empty));
    let nan = [0.0, f64::NAN];
    assert_eq!(kolmogorov_smirnov(&same, &nan), Err(StatisticsError::NotFinite { index: 1 }));
    Ok(())
}

/// Above a million paths, the series is used: scipy's `kstwobign.sf` of the corrected statistic.
#[test]
fn the_asymptotic_value_is_the_series() -> Result {
    let spread = |count: u32, shift: f64| numbers(count, |x| x / f64::from(count) + shift);
    for (n, m, shift, statistic, p) in [
        (1_200, 900, 0.02, 0.020_833_333_333_3, 0.977_704_295_293_2),
        (1_001, 1_500, 0.05, 0.050_998_334_998_3, 0.085_297_339_850_1),
    ] {
        let found = kolmogorov_smirnov(&spread(n, 0.0), &spread(m, shift))?;
        assert!((found.0 - statistic).abs() < 1e-12, "{found:?}");
        assert!((found.1 / p - 1.0).abs() < 1e-9, "{found:?} {p}");
    }
    let same = spread(1_001, 0.0);
    assert_eq!(kolmogorov_smirnov(&same, &same)?, (0.0, 1.0));
    Ok(())
}

/// Just above a million paths, the value is close to the exact one just below.
#[test]
fn the_asymptotic_value_continues_the_exact_one() -> Result {
    for shift in [20.0, 40.0, 70.0] {
        let p = |count: u32| {
            let scale = 1_000.0 / f64::from(count);
            let moved = numbers(count, |x| x * scale + shift);
            kolmogorov_smirnov(&numbers(count, |x| x * scale + 0.1), &moved)
        };
        let ((_, exact), (_, asymptotic)) = (p(1_000)?, p(1_001)?);
        assert!((asymptotic / exact - 1.0).abs() < 0.1, "{exact} {asymptotic}");
    }
    Ok(())
}

/// The p-values are those of scipy 1.17.1's `wilcoxon`; that of equal differences is the share of
/// all signs, counted one by one.
#[test]
fn wilcoxons_test_is_scipys() -> Result {
    let signed = |count: u32, period: f64| {
        numbers(count, |x| if (x + 1.0) % period == 0.0 { -x - 1.0 } else { x + 1.0 })
    };
    for (differences, positive, p) in [
        (vec![1.0, 2.0, 3.0], 6.0, 0.25),
        (vec![-1.0, 2.0, 3.0, 4.0], 9.0, 0.25),
        (vec![0.5, -1.5, 2.5, 3.5, -4.5, 6.5, 7.5], 21.0, 0.296_875),
        (vec![1.0, 1.0, -1.0, 2.0, 2.0, 3.0, -3.0, 4.0], 27.5, 0.242_187_5),
        (signed(20, 4.0), 150.0, 0.097_307_205_200_20),
        (signed(40, 100.0), 820.0, 1.818_989_403_546e-12),
        (signed(50, 3.0), 867.0, 0.026_166_968_171_2),
        (signed(50, 2.0), 625.0, 0.908_597_822_487),
        (signed(51, 3.0), 867.0, 0.056_455_805_367_7),
        (signed(100, 3.0), 3_367.0, 0.003_811_558_685_634),
        (
            numbers(80, |x| if x % 3.0 == 0.0 { -1.0 - x % 7.0 } else { 1.0 + x % 7.0 }),
            2_135.0,
            0.013_365_482_220_755,
        ),
        (numbers(60, |x| if x < 30.0 { 1.0 } else { -1.0 }), 915.0, 1.0),
    ] {
        let zeros = vec![0.0; differences.len()];
        let found = wilcoxon(&differences, &zeros)?;
        assert_eq!(found.0, positive);
        assert!((found.1 / p - 1.0).abs() < 1e-9, "{found:?} {p}");
        assert_eq!(wilcoxon(&zeros, &differences)?.1, found.1);
    }
    assert_eq!(wilcoxon(&[1.0, 2.0], &[1.0, 2.0])?.1, 1.0);
    // Differences larger than any number are computed as halves.
    let (a, b) = ([1e308, -1.2e308, 3.0], [-1e308, 1.7e308, 4.0]);
    assert_eq!(wilcoxon(&a, &b)?, wilcoxon(&[2.0, -2.9, 3.0], &[0.0, 0.0, 3.5])?);
    let lengths = StatisticsError::Lengths { first: 1, second: 2 };
    assert_eq!(wilcoxon(&[1.0], &[1.0, 2.0]), Err(lengths));
    Ok(())
}

/// A shift that is small beside the differences between episodes shows only in pairs.
#[test]
fn a_shift_of_every_pair_is_noticed() -> Result {
    let ours = numbers(300, |x| (x * 37.0) % 101.0);
    let theirs: Vec<_> = ours.iter().map(|x| x + 0.15 * 29.0).collect();
    assert!(kolmogorov_smirnov(&ours, &theirs)?.1 > 0.01);
    assert!(wilcoxon(&ours, &theirs)?.1 < 1e-40);
    Ok(())
}

#[test]
fn the_chi_square_test_is_the_formula() -> Result {
    // By hand: each count of 10 or 20 is expected to be 15.
    let (statistic, p) = chi_square(&[10, 20], &[20, 10])?;
    assert!((statistic - 20.0 / 3.0).abs() < 1e-12, "{statistic}");
    assert!((p - 0.009_823).abs() < 1e-6, "{p}");
    assert_eq!(chi_square(&[10, 20], &[10, 20])?.1, 1.0);
    // Three degrees of freedom, and unequal samples: scipy's chi2_contingency.
    let (statistic, p) = chi_square(&[30, 20, 10, 40], &[45, 55, 60, 40])?;
    assert!((3.0 * statistic - CONTINGENCY.0).abs() < 1e-9, "{statistic}");
    assert!((p / CONTINGENCY.1 - 1.0).abs() < 1e-9, "{p}");
    // Exactly five are expected, and one sample has none.
    let (statistic, p) = chi_square(&[30, 20, 0], &[20, 20, 10])?;
    assert!((statistic - 6.0).abs() < 1e-12 && (p / 2.478_752_176_666e-3 - 1.0).abs() < 1e-9);
    // 5 and 8 are merged, which is more than 9, and then 9 and 13.
    assert_eq!(
        chi_square(&[50, 1, 30, 4, 3], &[50, 8, 30, 4, 2])?,
        chi_square(&[50, 30, 8], &[50, 30, 14])?
    );
    // The two smallest categories expect too few, and are merged.
    assert_eq!(
        chi_square(&[30, 20, 3, 4], &[20, 30, 4, 3])?,
        chi_square(&[30, 20, 7], &[20, 30, 7])?
    );
    // Nothing to tell apart: one category, or too few of each.
    assert_eq!(chi_square(&[10, 0], &[20, 0])?, (0.0, 1.0));
    assert_eq!(chi_square(&[1, 2], &[2, 1])?, (0.0, 1.0));
    let lengths = StatisticsError::Lengths { first: 1, second: 2 };
    assert_eq!(chi_square(&[1], &[1, 2]), Err(lengths));
    assert_eq!(chi_square(&[0, 0], &[1, 2]), Err(StatisticsError::Empty));
    Ok(())
}

proptest! {
    /// Another formula for the statistic (Numerical Recipes, 14.3.1), and the closed form of the
    /// p-value for two and for four degrees of freedom.
    #[test]
    fn the_chi_square_test_has_closed_forms(
        table in prop::collection::vec((20_u64..200, 20_u64..200), 5),
        categories in prop::sample::select(vec![3, 5]),
    ) {
        let (a, b): (Vec<_>, Vec<_>) = table.into_iter().take(categories).unzip();
        let (statistic, p) = chi_square(&a, &b)?;
        let total = |counts: &[u64]| counts.iter().sum::<u64>() as f64;
        let ratio = (total(&b) / total(&a)).sqrt();
        let terms = a.iter().zip(&b).map(|(a, b)| {
            let (a, b) = (*a as f64, *b as f64);
            (ratio * a - b / ratio).powi(2) / (a + b)
        });
        let sum = terms.sum::<f64>();
        prop_assert!((statistic * (categories - 1) as f64 - sum).abs() < 1e-9 * sum.max(1.0));
        let half = 0.5 * sum;
        let expected = (-half).exp() * if categories == 3 { 1.0 } else { 1.0 + half };
        prop_assert!((p / expected - 1.0).abs() < 1e-7, "{p} {expected}");
        let swapped = chi_square(&b, &a)?;
        prop_assert!((swapped.0 - statistic).abs() < 1e-9 && (swapped.1 - p).abs() < 1e-9);
    }
}

/// The statistic and the p-value of scipy 1.17.1's `chi2_contingency`.
const CONTINGENCY: (f64, f64) = (24.4285714285714, 2.032771345514e-05);

#[test]
fn the_normal_test_is_the_textbooks() {
    for z in [1.959_964, -1.959_964] {
        assert!((normal_test(z) - 0.05).abs() < 1e-6);
    }
    assert_eq!(normal_test(0.0), 1.0);
}
