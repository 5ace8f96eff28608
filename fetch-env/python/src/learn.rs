//! Learning and evaluating.

use baselines::{
    Evaluation, evaluate_vec,
    learn::{TrainSettings, Trainer as Run},
};
use fetch_env::{FetchConfig, MujocoEnv, make, make_vec, vec_env::VecConfig};
use pyo3::prelude::*;

use crate::config::Config;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::policy::Policy;
use crate::warnings::simulate;

/// A run of the learner.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Trainer {
    run: Exclusive<Run<MujocoEnv>>,
    env_id: String,
}

#[pymethods]
impl Trainer {
    /// `settings` is JSON, or the name of a preset.
    #[new]
    fn new(
        py: Python<'_>,
        config: &Config,
        settings: &str,
        seed: Integer<u64>,
        num_threads: Integer<usize>,
    ) -> Result<Self> {
        let (Integer(seed), Integer(num_threads)) = (seed, num_threads);
        let env: FetchConfig = config.config.clone();
        let settings = match settings {
            "fast" => TrainSettings::fast(env.task()),
            "book" => TrainSettings::book(env.task()),
            "authors" => TrainSettings::authors(),
            json if json.starts_with('{') => serde_json::from_str(json).map_err(|error| {
                Error::value(format!("these are not settings of the learner: {error}"))
            })?,
            name => {
                return Err(Error::value(format!(
                    "there is no preset {name:?}: pass \"fast\", \"book\", \"authors\" or \
                     settings"
                )));
            }
        };
        let run = simulate(py, || {
            Run::new(|| Ok(make(env.clone())?), settings, seed, num_threads).map_err(Error::chain)
        })?;
        Ok(Self { run: Exclusive::new(run), env_id: config.env_id() })
    }

    /// Takes the next cycle of a run of this many steps, and returns a row of the learning curve as
    /// JSON if an evaluation was due.
    fn cycle(&self, py: Python<'_>, num_steps: u64) -> Result<Option<String>> {
        let run = &mut *self.run.lock(py)?;
        let row = simulate(py, || run.run_cycle(num_steps).map_err(Error::chain))?;
        Ok(row.map(|row| serde_json::to_string(&row)).transpose()?)
    }

    /// The number of steps so far.
    fn steps(&self, py: Python<'_>) -> Result<u64> {
        Ok(self.run.lock(py)?.counters().steps)
    }

    /// The settings as JSON.
    fn settings(&self, py: Python<'_>) -> Result<String> {
        Ok(serde_json::to_string(self.run.lock(py)?.settings())?)
    }

    /// The policy that the run has learned.
    fn policy(&self, py: Python<'_>) -> Result<Policy> {
        let policy = self.run.lock(py)?.policy(&self.env_id).map_err(Error::chain)?;
        Ok(policy.into())
    }
}

/// Runs episodes of a policy, and returns their summary as JSON.
#[pyfunction]
pub(crate) fn evaluate(
    py: Python<'_>,
    config: &Config,
    policy: &Policy,
    episodes: Integer<usize>,
    seed: Integer<u64>,
    num_threads: Integer<usize>,
) -> Result<String> {
    let (Integer(episodes), Integer(seed)) = (episodes, seed);
    let (env, mut policy) = (config.config.clone(), policy.copy(py)?);
    let num_envs = episodes.clamp(1, 16);
    let threads = VecConfig::default().with_num_threads(num_threads.0);
    let summary = simulate(py, || -> Result<_> {
        let mut envs = make_vec(env, num_envs, threads)?;
        let mut evaluation = Evaluation { episodes: Vec::new() };
        // One episode in each environment at a time, with a look for Ctrl-C in between.
        while evaluation.episodes.len() < episodes {
            Python::attach(|py| py.check_signals())?;
            let done = evaluation.episodes.len();
            let (count, seed) = (num_envs.min(episodes - done), seed.wrapping_add(done as u64));
            let next = evaluate_vec(&mut envs, &mut policy, count, seed, |_| ());
            evaluation.episodes.extend(next.map_err(Error::chain)?.episodes);
        }
        evaluation.summary().map_err(Error::chain)
    })?;
    Ok(serde_json::to_string(&summary)?)
}
