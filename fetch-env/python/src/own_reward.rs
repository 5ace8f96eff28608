//! Rewards that a Python function computes.

use std::sync::{Mutex, PoisonError};

use goal_reward::{DistanceReward, GoalError, GoalPairs, GoalReward};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::arrays::{Numbers, Shape};
use crate::error::{Error, Result};

/// The rewards of a function of the achieved goals, the desired goals and the infos of a batch.
pub(crate) struct OwnReward<'a> {
    function: &'a Py<PyAny>,
    /// Tells which goals are reached.
    settings: DistanceReward,
    /// The first error of the function, for which the trait has no place.
    error: Mutex<Option<Error>>,
}

impl<'a> OwnReward<'a> {
    pub(crate) const fn new(function: &'a Py<PyAny>, settings: DistanceReward) -> Self {
        Self { function, settings, error: Mutex::new(None) }
    }

    /// Returns the error of the function, if it has failed.
    pub(crate) fn into_error(self) -> Option<Error> {
        self.error.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Calls the function with goals in the precision of the buffer, and one empty info a row: a
    /// buffer stores no infos.
    fn call(&self, py: Python<'_>, pairs: GoalPairs<'_>) -> Result<Vec<f64>> {
        let count = pairs.len();
        let rows = |goals: &[f64]| {
            let goals = PyArray1::from_iter(py, goals.iter().map(|number| *number as f32));
            goals.reshape([count, pairs.dim()])
        };
        let infos = PyList::new(py, (0..count).map(|_| PyDict::new(py)))?;
        let (achieved, desired) = (rows(pairs.achieved())?, rows(pairs.desired())?);
        let rewards = Numbers::take(
            "the reward function's result",
            self.function.bind(py).call1((achieved, desired, infos))?.as_any(),
        )?;
        if rewards.shape() != [count] {
            let (actual, expected) = (Shape(rewards.shape()), Shape(&[count]));
            return Err(Error::value(format!(
                "the reward function returned an array of the shape {actual}: return {expected}, \
                 a reward for each row"
            )));
        }
        let rewards = rewards.to_double();
        match rewards.iter().position(|reward| !(*reward as f32).is_finite()) {
            None => Ok(rewards),
            Some(row) => Err(Error::value(format!(
                "the reward function returned {:?} for row {row}: return finite numbers",
                rewards[row]
            ))),
        }
    }
}

impl GoalReward for OwnReward<'_> {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let mut reward = [f64::NAN];
        match GoalPairs::new(achieved_goal, desired_goal, achieved_goal.len()) {
            Ok(pair) if self.reward_batch(pair, &mut reward).is_ok() => reward[0],
            _ => f64::NAN,
        }
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.settings.is_success(achieved_goal, desired_goal)
    }

    /// Leaves `out` as it is if the function fails: NaN, which no batch may have.
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        let (expected, actual) = (pairs.len(), out.len());
        if expected != actual {
            return Err(GoalError::OutputLength { expected, actual });
        }
        match Python::attach(|py| self.call(py, pairs)) {
            Ok(rewards) => out.copy_from_slice(&rewards),
            Err(error) => {
                let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
                first.get_or_insert(error);
            }
        }
        Ok(())
    }
}
