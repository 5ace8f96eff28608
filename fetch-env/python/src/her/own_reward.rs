//! Rewards and terminations that Python functions compute.

use std::sync::{Mutex, PoisonError};

use goal_reward::{GoalError, GoalPairs, GoalReward};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::arrays::{Numbers, Shape};
use crate::error::{Error, Result};
use crate::task::{AnyReward, check_output};

/// The rewards and the terminations of functions of the achieved goals, the desired goals and the
/// infos of a batch; those of the settings, or of the task, where there is no function.
pub(super) struct OwnReward<'a> {
    reward: Option<&'a Py<PyAny>>,
    terminated: Option<&'a Py<PyAny>>,
    /// Tells which goals are reached.
    settings: &'a AnyReward,
    /// The first error of a function, for which the trait has no place.
    error: Mutex<Option<Error>>,
}

impl<'a> OwnReward<'a> {
    pub(super) const fn new(
        reward: Option<&'a Py<PyAny>>,
        terminated: Option<&'a Py<PyAny>>,
        settings: &'a AnyReward,
    ) -> Self {
        Self { reward, terminated, settings, error: Mutex::new(None) }
    }

    /// Returns the error of a function, if one has failed.
    pub(super) fn into_error(self) -> Option<Error> {
        self.error.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the results of the function of this name; `None` if it has failed.
    fn call(&self, name: &str, function: &Py<PyAny>, pairs: GoalPairs<'_>) -> Option<Vec<f64>> {
        let keep = |error| {
            let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(error);
        };
        Python::attach(|py| call(py, name, function, pairs)).map_err(keep).ok()
    }
}

/// Calls a function with goals in the precision of the buffer, and one empty info a row: a buffer
/// stores no infos.
fn call(
    py: Python<'_>,
    name: &str,
    function: &Py<PyAny>,
    pairs: GoalPairs<'_>,
) -> Result<Vec<f64>> {
    let count = pairs.len();
    let rows = |goals: &[f64]| {
        let goals = PyArray1::from_iter(py, goals.iter().map(|number| *number as f32));
        goals.reshape([count, pairs.dim()])
    };
    let infos = PyList::new(py, (0..count).map(|_| PyDict::new(py)))?;
    let (achieved, desired) = (rows(pairs.achieved())?, rows(pairs.desired())?);
    let results = Numbers::take(
        &format!("the {name} function's result"),
        function.bind(py).call1((achieved, desired, infos))?.as_any(),
    )?;
    if results.shape() != [count] {
        let (actual, expected) = (Shape(results.shape()), Shape(&[count]));
        return Err(Error::value(format!(
            "the {name} function returned an array of the shape {actual}: return {expected}, a \
             number for each row"
        )));
    }
    let results = results.to_double();
    match results.iter().position(|result| !(*result as f32).is_finite()) {
        None => Ok(results),
        Some(row) => Err(Error::value(format!(
            "the {name} function returned {:?} for row {row}: return finite numbers",
            results[row]
        ))),
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

    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.settings.is_success_batch(pairs, out)
    }

    /// Leaves `out` as it is if the function fails: NaN, which no batch may have.
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        let Some(function) = self.reward else { return self.settings.reward_batch(pairs, out) };
        check_output(pairs, out.len())?;
        if let Some(rewards) = self.call("reward", function, pairs) {
            out.copy_from_slice(&rewards);
        }
        Ok(())
    }

    fn terminated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        let Some(function) = self.terminated else {
            return self.settings.terminated_batch(pairs, out);
        };
        check_output(pairs, out.len())?;
        let flags = self.call("terminated", function, pairs).unwrap_or_default();
        for (out, flag) in out.iter_mut().zip(flags) {
            *out = flag != 0.0;
        }
        Ok(())
    }
}
