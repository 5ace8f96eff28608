//! What is measured: curves over one factor, and pairs of factors.

use std::str::FromStr;

use anyhow::Context;
use baselines::Estimate;
use baselines::robustness::{RobustnessCurve, SuccessAt};
use serde::Serialize;

/// The success rate below which a value is critical.
pub const CRITICAL: f64 = 0.5;

/// When an episode counts as a success.
pub const TIMES: [(&str, SuccessAt); 2] =
    [("the end", SuccessAt::End), ("any time", SuccessAt::AnyTime)];

/// A factor, and values of it.
#[derive(Clone, Debug, Serialize)]
pub struct Values {
    pub factor: String,
    pub values: Vec<f64>,
}

impl Values {
    /// Returns the factor with each value.
    pub fn each(&self) -> impl Iterator<Item = (&str, f64)> {
        self.values.iter().map(|&value| (self.factor.as_str(), value))
    }
}

impl FromStr for Values {
    type Err = anyhow::Error;

    fn from_str(text: &str) -> anyhow::Result<Self> {
        let (factor, values) = text.split_once('=').context("write NAME=VALUE,...")?;
        let value =
            |text: &str| text.trim().parse().with_context(|| format!("{text:?} is no number"));
        Ok(Self {
            factor: factor.into(),
            values: values.split(',').map(value).collect::<Result<_, _>>()?,
        })
    }
}

/// The curves of a policy, or of several that a folder of runs has.
pub struct Measured {
    /// What the user calls it.
    pub policy: String,
    /// Each policy's name or file, with its curve.
    pub curves: Vec<(String, RobustnessCurve)>,
}

impl Measured {
    pub fn factor(&self) -> &str {
        &self.curves[0].1.factor
    }

    /// Returns the mean over the policies of what a curve has.
    pub fn mean(&self, of: impl Fn(&RobustnessCurve) -> f64) -> f64 {
        self.curves.iter().map(|(_, curve)| of(curve)).sum::<f64>() / self.curves.len() as f64
    }
}

/// The success rates for each pair of values of two factors: of a policy, or the mean of several.
pub struct Pair {
    pub policy: String,
    /// The factors of the rows and of the columns.
    pub factors: [Values; 2],
    pub rows: Vec<Rates>,
}

impl Pair {
    /// Returns the success rates of the cells at the end and at any time, row after row.
    pub fn cells(&self) -> impl Iterator<Item = [Estimate; 2]> {
        self.rows.iter().flat_map(|row| row.points().map(|(_, end, any, _)| [end, any]))
    }
}

/// Returns the curves of each factor, which follow each other.
pub fn by_factor(measured: &[Measured]) -> impl Iterator<Item = &[Measured]> {
    measured.chunk_by(|one, next| one.factor() == next.factor())
}

/// The figures at each value, of a policy or the mean of several.
pub struct Rates {
    pub policy: String,
    /// The values with their success rates at the end.
    pub end: Vec<(f64, Estimate)>,
    /// The values with their success rates at any time.
    pub any: Vec<(f64, Estimate)>,
    /// The final distances, in meters.
    pub distances: Vec<f64>,
}

impl Rates {
    /// Returns the figures of a policy, or the mean over several.
    pub fn of(measured: &Measured) -> anyhow::Result<Self> {
        let Measured { policy, curves } = measured;
        if let [(_, curve)] = &curves[..] {
            return Ok(Self::of_one(policy, curve));
        }
        let policy = format!("{policy}, mean of {} runs", curves.len());
        let of_runs: Vec<_> = curves.iter().map(|(_, curve)| curve.clone()).collect();
        let mean = |at| RobustnessCurve::mean_rates(&of_runs, at);
        let (end, any) = (mean(SuccessAt::End)?, mean(SuccessAt::AnyTime)?);
        let distances = (0..end.len()).map(|point| measured.mean(|curve| distance(curve, point)));
        Ok(Self { policy, end, any, distances: distances.collect() })
    }

    /// Returns the figures of one policy.
    pub fn of_one(policy: &str, curve: &RobustnessCurve) -> Self {
        Self {
            policy: policy.to_owned(),
            end: curve.rates(SuccessAt::End).collect(),
            any: curve.rates(SuccessAt::AnyTime).collect(),
            distances: (0..curve.points.len()).map(|point| distance(curve, point)).collect(),
        }
    }

    /// Returns each value, the success rates at the end and at any time, and the final distance.
    pub fn points(&self) -> impl Iterator<Item = (f64, Estimate, Estimate, f64)> {
        let rates = self.end.iter().zip(&self.any).zip(&self.distances);
        rates.map(|((&(value, end), &(_, any)), &distance)| (value, end, any, distance))
    }

    /// Returns the first value at which less than [`CRITICAL`] of the episodes succeed.
    pub fn critical(&self, at: SuccessAt) -> Option<f64> {
        self.at(at).iter().find(|(_, rate)| rate.value < CRITICAL).map(|(value, _)| *value)
    }

    pub fn at(&self, at: SuccessAt) -> &[(f64, Estimate)] {
        match at {
            SuccessAt::End => &self.end,
            SuccessAt::AnyTime => &self.any,
        }
    }
}

fn distance(curve: &RobustnessCurve, point: usize) -> f64 {
    curve.points[point].summary.final_distance_mean.value
}
