//! What is measured: curves over one factor, and pairs of factors.

use std::str::FromStr;

use anyhow::Context;
use baselines::robustness::{RobustnessCurve, SuccessAt};
use baselines::{Estimate, Summary};
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

/// The curve of a policy.
pub struct Measured {
    pub policy: String,
    pub curve: RobustnessCurve,
}

/// The figures of a policy for each pair of values of two factors, row after row.
pub struct Pair {
    pub policy: String,
    /// The factors of the rows and of the columns.
    pub factors: [Values; 2],
    pub cells: Vec<Summary>,
}

/// Returns the curves of each factor, which follow each other.
pub fn by_factor(measured: &[Measured]) -> impl Iterator<Item = &[Measured]> {
    measured.chunk_by(|one, next| one.curve.factor == next.curve.factor)
}

/// The success rates of a curve, or of the mean of several.
#[derive(Clone)]
pub struct Rates {
    pub policy: String,
    pub end: Vec<(f64, Estimate)>,
    pub any: Vec<(f64, Estimate)>,
}

impl Rates {
    pub fn of(Measured { policy, curve }: &Measured) -> Self {
        Self {
            policy: policy.clone(),
            end: curve.rates(SuccessAt::End).collect(),
            any: curve.rates(SuccessAt::AnyTime).collect(),
        }
    }

    /// Returns the mean over policies.
    pub fn mean(measured: &[Measured]) -> anyhow::Result<Self> {
        let curves: Vec<_> = measured.iter().map(|measured| measured.curve.clone()).collect();
        Ok(Self {
            policy: format!("mean of {} policies", curves.len()),
            end: RobustnessCurve::mean_rates(&curves, SuccessAt::End)?,
            any: RobustnessCurve::mean_rates(&curves, SuccessAt::AnyTime)?,
        })
    }

    pub fn at(&self, at: SuccessAt) -> &[(f64, Estimate)] {
        match at {
            SuccessAt::End => &self.end,
            SuccessAt::AnyTime => &self.any,
        }
    }
}
