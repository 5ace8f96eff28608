//! Trained policies.

use std::path::PathBuf;

use baselines::TrainedPolicy;
use fetch_env::EnvId;
use her_relabel::StateRows;
use numpy::{PyArray2, PyArrayMethods};
use pyo3::{prelude::*, types::PyBytes};

use crate::arrays::Numbers;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;

/// A trained policy.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Policy(Exclusive<TrainedPolicy>);

#[pymethods]
impl Policy {
    /// Reads the contents of a file.
    #[new]
    fn new(contents: &[u8]) -> Result<Self> {
        Ok(Self::from(TrainedPolicy::from_bytes(contents).map_err(Error::value)?))
    }

    /// Loads a file.
    #[staticmethod]
    fn load(path: PathBuf) -> Result<Self> {
        Ok(Self::from(TrainedPolicy::load(path).map_err(Error::chain)?))
    }

    /// The policy that comes with the package for an environment's task.
    #[staticmethod]
    fn shipped(env_id: &str) -> Result<Self> {
        let id: EnvId = env_id.strip_prefix("fetch_env/").unwrap_or(env_id).parse()?;
        Ok(Self::from(TrainedPolicy::shipped(id.task).map_err(Error::value)?))
    }

    /// The contents of a file with this policy.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.0.lock(py)?.to_bytes().map_err(Error::value)?))
    }

    /// How the policy was trained, as JSON.
    fn header(&self, py: Python<'_>) -> Result<String> {
        Ok(serde_json::to_string(self.0.lock(py)?.header())?)
    }

    /// The greedy actions for states, one in each row.
    fn act<'py>(
        &self,
        py: Python<'py>,
        observation: &Bound<'py, PyAny>,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyArray2<f32>>> {
        let observation = Numbers::take(observation)?;
        let rows = observation.shape().iter().rev().skip(1).product();
        let (observation, achieved_goal, desired_goal) = (
            observation.to_double(),
            Numbers::take(achieved_goal)?.to_double(),
            Numbers::take(desired_goal)?.to_double(),
        );
        let states = StateRows {
            observation: &observation,
            achieved_goal: &achieved_goal,
            desired_goal: &desired_goal,
        };
        let mut policy = self.0.lock(py)?;
        let action_len = policy.header().action_len;
        let mut actions = vec![0.0; rows * action_len];
        policy.act_rows(&states, &mut actions).map_err(Error::value)?;
        Ok(numpy::PyArray1::from_vec(py, actions).reshape([rows, action_len])?)
    }
}

impl From<TrainedPolicy> for Policy {
    fn from(policy: TrainedPolicy) -> Self {
        Self(Exclusive::new(policy))
    }
}

impl Policy {
    /// Returns a copy for this call alone.
    pub(crate) fn copy(&self, py: Python<'_>) -> Result<TrainedPolicy> {
        Ok(self.0.lock(py)?.clone())
    }
}
