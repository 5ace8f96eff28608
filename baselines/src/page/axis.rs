//! Axes of plots.

use std::ops::Range;

use plotters::coord::{
    ranged1d::{BoldPoints, Ranged},
    types::RangedCoordf64,
};

use super::document::number;

/// The maximum number of ticks of an axis.
const TICKS: usize = 6;

/// An axis: its label with the unit, and the range that is shown.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub(super) label: String,
    pub(super) range: Range<f64>,
}

impl Axis {
    /// Returns an axis from `low` to `high`; a range of a single value is widened by 0.5 either
    /// way.
    #[must_use]
    pub fn new(label: &str, low: f64, high: f64) -> Self {
        let range = if low == high { low - 0.5..high + 0.5 } else { low..high };
        Self { label: label.into(), range }
    }

    /// Returns an axis that shows all of some values, with a margin.
    #[must_use]
    pub fn around(label: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let (low, high) = extent(values);
        let margin = 0.05 * (high - low);
        Self::new(label, low - margin, high + margin)
    }

    pub(super) fn length(&self) -> f64 {
        self.range.end - self.range.start
    }

    pub(super) fn clamp(&self, value: f64) -> f64 {
        value.max(self.range.start).min(self.range.end)
    }

    /// Returns round numbers in the range, each with its label.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (f64, String)> {
        let ticks = RangedCoordf64::from(self.range.clone()).key_points(BoldPoints(TICKS));
        let step = ticks.windows(2).map(|pair| pair[1] - pair[0]).fold(f64::INFINITY, f64::min);
        let decimals = (-(step + 1e-9 * self.length()).log10().floor()).max(0.0) as usize;
        ticks.into_iter().map(move |tick| (tick, number(tick, decimals)))
    }
}

/// Returns the least and the greatest of some values: infinity and minus infinity if there are
/// none.
fn extent(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    values
        .into_iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}
