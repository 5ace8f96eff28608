//! The statistics that LeRobot normalizes by: range, mean and standard deviation of each element.

use serde_json::{Value, json};

/// The statistics of rows of numbers, element by element.
#[derive(Clone, Debug)]
pub(super) struct Statistics {
    pub(super) count: u64,
    pub(super) min: Vec<f64>,
    pub(super) max: Vec<f64>,
    pub(super) mean: Vec<f64>,
    /// The sums of the squared distances from the mean.
    squares: Vec<f64>,
}

impl Statistics {
    /// Returns the statistics of no rows.
    pub(super) fn new(width: usize) -> Self {
        Self {
            count: 0,
            min: vec![f64::INFINITY; width],
            max: vec![f64::NEG_INFINITY; width],
            mean: vec![0.0; width],
            squares: vec![0.0; width],
        }
    }

    pub(super) fn of(numbers: &[f64], width: usize) -> Self {
        let mut statistics = Self::new(width);
        let count = numbers.len() / width;
        statistics.count = count as u64;
        for element in 0..width {
            let column = || numbers.iter().skip(element).step_by(width);
            let mean = column().sum::<f64>() / count as f64;
            statistics.min[element] = column().copied().fold(f64::INFINITY, f64::min);
            statistics.max[element] = column().copied().fold(f64::NEG_INFINITY, f64::max);
            statistics.mean[element] = mean;
            statistics.squares[element] = column().map(|number| (number - mean).powi(2)).sum();
        }
        statistics
    }

    /// Adds the rows of other statistics.
    ///
    /// Source: Chan, Golub and LeVeque, *Updating formulae and a pairwise algorithm for computing
    /// sample variances*, 1979.
    pub(super) fn add(&mut self, other: &Self) {
        let (own, others) = (self.count as f64, other.count as f64);
        let both = own + others;
        self.count += other.count;
        for element in 0..self.mean.len() {
            let difference = other.mean[element] - self.mean[element];
            self.min[element] = self.min[element].min(other.min[element]);
            self.max[element] = self.max[element].max(other.max[element]);
            self.mean[element] += difference * others / both;
            self.squares[element] +=
                other.squares[element] + difference.powi(2) * own * others / both;
        }
    }

    /// Returns the standard deviations of all rows, not of a sample.
    pub(super) fn std(&self) -> Vec<f64> {
        let count = self.count as f64;
        self.squares.iter().map(|squares| (squares / count).sqrt()).collect()
    }

    pub(super) fn describe(&self) -> Value {
        let Self { count, min, max, mean, .. } = self;
        json!({ "min": min, "max": max, "mean": mean, "std": self.std(), "count": [count] })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_have_the_statistics_of_the_whole() {
        let numbers: Vec<_> = (0..24).map(|number| f64::from(number * number % 13)).collect();
        let whole = Statistics::of(&numbers, 2);
        let mut parts = Statistics::new(2);
        for part in [&numbers[..2], &numbers[2..14], &numbers[14..]] {
            parts.add(&Statistics::of(part, 2));
        }
        assert_eq!((parts.count, &parts.min, &parts.max), (12, &whole.min, &whole.max));
        for (left, right) in [(&parts.mean, &whole.mean), (&parts.std(), &whole.std())] {
            for (left, right) in left.iter().zip(right) {
                assert!((left - right).abs() < 1e-12, "{left} {right}");
            }
        }
        let first: Vec<_> = numbers.iter().step_by(2).collect();
        let mean = first.iter().copied().sum::<f64>() / 12.0;
        let variance = first.iter().map(|number| (*number - mean).powi(2)).sum::<f64>() / 12.0;
        assert!((whole.std()[0] - variance.sqrt()).abs() < 1e-12);
    }
}
