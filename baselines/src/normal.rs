//! Numbers of the standard normal distribution.

use std::f32::consts::TAU;

use rand::{Rng, RngExt};

/// Draws a number of the standard normal distribution, with the same bits on each processor.
///
/// Source: Box and Muller, *A note on the generation of random normal deviates*, 1958.
pub(crate) fn standard_normal(rng: &mut impl Rng) -> f32 {
    // Never 0, whose logarithm is infinite.
    let share: f32 = 1.0 - rng.random::<f32>();
    let turn: f32 = rng.random();
    (-2.0 * libm::logf(share)).sqrt() * libm::cosf(TAU * turn)
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use statrs::distribution::{ContinuousCDF, Normal};

    use super::standard_normal;

    /// The largest distance of the empirical distribution from the normal one stays below the
    /// bound that Kolmogorov and Smirnov's test exceeds once in 1,000 times.
    #[test]
    fn numbers_are_normal() {
        const COUNT: usize = 100_000;
        let mut rng = ChaCha8Rng::seed_from_u64(0);
        let mut numbers: Vec<f32> = (0..COUNT).map(|_| standard_normal(&mut rng)).collect();
        numbers.sort_by(f32::total_cmp);
        let normal = Normal::standard();
        let distance = |(rank, number): (usize, &f32)| {
            (normal.cdf(f64::from(*number)) - (rank as f64 + 0.5) / COUNT as f64).abs()
        };
        let largest = numbers.iter().enumerate().map(distance).fold(0.0, f64::max);
        assert!(largest < 1.95 / (COUNT as f64).sqrt(), "{largest}");
    }
}
