//! How a policy's success depends on a factor of the environment, such as observation noise.
//!
//! ```
//! use baselines::robustness::{RobustnessCurve, SuccessAt};
//! use baselines::{EvaluationError, ScriptedPolicy, evaluate};
//! use fetch_env::{EnvError, FetchConfig, KinematicSimulator, RewardKind, Task, FetchEnv};
//! use fetch_env::variation::Variation;
//!
//! let measure = |noise: f64| -> Result<_, Box<dyn std::error::Error>> {
//!     let variation = Variation::default().with("observation_noise", noise)?;
//!     let config = FetchConfig::new(Task::Reach, RewardKind::Sparse).with_variation(variation);
//!     let simulator = KinematicSimulator::new(config.sim());
//!     let mut env = FetchEnv::new(config, simulator)?.time_limited();
//!     let mut policy = ScriptedPolicy::new(Task::Reach);
//!     Ok(evaluate(&mut env, &mut policy, 20, 0, |_| ())?)
//! };
//! let curve = RobustnessCurve::measure("observation_noise", &[0.0, 0.01], measure)?;
//! assert_eq!(curve.rates(SuccessAt::End).next().map(|(_, rate)| rate.value), Some(1.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use serde::{Deserialize, Serialize};

use crate::evaluate::{Evaluation, EvaluationError, Summary};
use crate::statistics::{Estimate, StatisticsError};

/// How a policy does at several values of one factor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustnessCurve {
    /// The factor's name, such as `observation_noise`.
    pub factor: String,
    /// The values, in the order in which they were measured.
    pub points: Vec<RobustnessPoint>,
}

/// How a policy does at one value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RobustnessPoint {
    /// The value.
    pub value: f64,
    /// The figures of the episodes.
    pub summary: Summary,
}

/// When an episode counts as a success.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SuccessAt {
    /// If its last step is one: the benchmark's success rate.
    End,
    /// If any of its steps is one.
    AnyTime,
}

impl RobustnessCurve {
    /// Evaluates a policy at each value, with a function that runs the episodes.
    ///
    /// # Errors
    /// Those of the function, and as [`Evaluation::summary`].
    pub fn measure<X: From<EvaluationError>>(
        factor: &str,
        values: &[f64],
        mut evaluate: impl FnMut(f64) -> Result<Evaluation, X>,
    ) -> Result<Self, X> {
        let point = |&value: &f64| {
            let summary = evaluate(value)?.summary()?;
            Ok(RobustnessPoint { value, summary })
        };
        Ok(Self {
            factor: factor.into(),
            points: values.iter().map(point).collect::<Result<_, X>>()?,
        })
    }

    /// Returns the values with their success rates.
    pub fn rates(&self, at: SuccessAt) -> impl Iterator<Item = (f64, Estimate)> {
        self.points.iter().map(move |RobustnessPoint { value, summary }| {
            let rate = match at {
                SuccessAt::End => summary.success_rate,
                SuccessAt::AnyTime => summary.success_any_rate,
            };
            (*value, rate)
        })
    }

    /// Returns the mean success rate of several curves, such as those of several training seeds, at
    /// each value of the first, with Student's 95 % interval within 0 and 1.
    ///
    /// # Errors
    /// [`StatisticsError::Empty`] if a value is not in all curves, or there are no curves.
    pub fn mean_rates(
        curves: &[Self],
        at: SuccessAt,
    ) -> Result<Vec<(f64, Estimate)>, StatisticsError> {
        let first = curves.first().ok_or(StatisticsError::Empty)?;
        let mean = |&RobustnessPoint { value, .. }| {
            let rate = |curve: &Self| {
                curve.rates(at).find(|(v, _)| *v == value).map(|(_, rate)| rate.value)
            };
            let rates: Option<Vec<_>> = curves.iter().map(rate).collect();
            let Estimate { value: rate, low, high } = Estimate::mean(&rates.unwrap_or_default())?;
            Ok((value, Estimate { value: rate, low: low.max(0.0), high: high.min(1.0) }))
        };
        first.points.iter().map(mean).collect()
    }

    /// Returns the first value whose success rate is below `rate`.
    #[must_use]
    pub fn critical_value(&self, at: SuccessAt, rate: f64) -> Option<f64> {
        self.rates(at).find(|(_, measured)| measured.value < rate).map(|(value, _)| value)
    }

    /// Returns the slope of the straight line with the smallest squared distance from the success
    /// rates; NaN for fewer than two different values.
    #[must_use]
    pub fn slope(&self, at: SuccessAt) -> f64 {
        let count = self.points.len() as f64;
        let mean = |of: fn((f64, Estimate)) -> f64| self.rates(at).map(of).sum::<f64>() / count;
        let (value_mean, rate_mean) = (mean(|(value, _)| value), mean(|(_, rate)| rate.value));
        let (mut together, mut alone) = (0.0, 0.0);
        for (value, rate) in self.rates(at) {
            together += (value - value_mean) * (rate.value - rate_mean);
            alone += (value - value_mean).powi(2);
        }
        together / alone
    }

    /// Returns the area under the success rates by trapezoids: at most the last value minus the
    /// first.
    #[must_use]
    pub fn area(&self, at: SuccessAt) -> f64 {
        let pairs = self.rates(at).zip(self.rates(at).skip(1));
        pairs.map(|((a, low), (b, high))| (b - a) * (low.value + high.value) / 2.0).sum()
    }
}
