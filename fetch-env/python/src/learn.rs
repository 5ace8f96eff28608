//! Learning and evaluating.

use std::io;
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::available_parallelism;

use baselines::{
    evaluate_vec_while,
    learn::{self, CheckpointError, Preset, Target, TrainSettings},
};
use fetch_env::{EnvError, FetchConfig, MujocoEnv, make, make_vec, vec_env::VecConfig};
use pyo3::{Borrowed, exceptions::PyTypeError, prelude::*, types::PyBool};

use crate::config::Config;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::policy::Policy;
use crate::signals::Signals;
use crate::warnings::simulate;

/// The number of evaluations in a row that must reach a target.
const EVALUATIONS: usize = 2;

/// A success rate, from 0 to 1.
pub(crate) struct Rate(f64);

impl<'a, 'py> FromPyObject<'a, 'py> for Rate {
    type Error = PyErr;

    fn extract(number: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        if number.is_instance_of::<PyBool>() {
            return Err(PyTypeError::new_err("a success rate is a number from 0 to 1"));
        }
        match number.extract() {
            Ok(rate @ 0.0..=1.0) => Ok(Self(rate)),
            Ok(rate) => Err(Error::value(format!(
                "{rate} is no success rate: pass a number from 0 to 1, or None to use all steps"
            ))
            .into()),
            Err(error) => Err(error),
        }
    }
}

/// A run of the learner.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Trainer {
    run: Exclusive<learn::Trainer<MujocoEnv>>,
    env_id: String,
    num_steps: u64,
    target: Option<Target>,
    /// Whether a cycle has failed: the run cannot go on, and is not saved.
    failed: AtomicBool,
}

#[pymethods]
impl Trainer {
    /// `settings` is JSON, or the name of a preset. With `resumed`, it continues the run whose
    /// checkpoints are in that folder.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "the Python function has as many")]
    fn new(
        py: Python<'_>,
        config: &Config,
        settings: &str,
        seed: Integer<u64>,
        steps: Integer<u64>,
        target: Option<Rate>,
        num_threads: Integer<usize>,
        resumed: Option<PathBuf>,
    ) -> Result<Self> {
        let (Integer(seed), Integer(num_steps)) = (seed, steps);
        let num_threads = match num_threads.0 {
            0 => available_parallelism().map_or(1, NonZero::get),
            number => number,
        };
        let env: FetchConfig = config.config.clone();
        let settings = if settings.starts_with('{') {
            TrainSettings::from_json(settings).map_err(Error::chain)?
        } else {
            settings.parse::<Preset>().map_err(Error::chain)?.settings(env.task())
        };
        let make = || -> Result<_, EnvError> { Ok(make(env.clone())?) };
        let run = simulate(py, || match resumed {
            None => learn::Trainer::new(make, settings, seed, num_threads).map_err(Error::chain),
            Some(folder) => {
                learn::Trainer::resume_or_new(make, settings, seed, num_threads, folder)
                    .map_err(Error::chain)
            }
        })?;
        let target =
            target.map(|Rate(success_rate)| Target { success_rate, evaluations: EVALUATIONS });
        let env_id = config.env_id();
        Ok(Self {
            run: Exclusive::new(run),
            env_id,
            num_steps,
            target,
            failed: AtomicBool::new(false),
        })
    }

    /// Whether the run has reached its steps or its target.
    fn is_over(&self, py: Python<'_>) -> Result<bool> {
        Ok(self.run.lock(py)?.is_over(self.num_steps, self.target))
    }

    /// Takes the next cycle, and returns a row of the learning curve as JSON if an evaluation was
    /// due. An exception of a signal handler stops the cycle, which the next call finishes.
    fn cycle(&self, py: Python<'_>) -> Result<Option<String>> {
        let run = &mut *self.run.lock(py)?;
        let mut signals = Signals::new();
        let row = simulate(py, || {
            run.run_cycle_while(self.num_steps, || signals.go_on()).map_err(Error::chain)
        });
        if row.is_err() {
            self.failed.store(true, Relaxed);
        }
        signals.finish()?;
        Ok(row?.map(|row| serde_json::to_string(&row)).transpose()?)
    }

    /// Whether a cycle has failed.
    fn has_failed(&self) -> bool {
        self.failed.load(Relaxed)
    }

    /// Saves a checkpoint in a folder.
    fn save(&self, py: Python<'_>, folder: PathBuf) -> Result<()> {
        let run = &mut *self.run.lock(py)?;
        simulate(py, || {
            run.save(&folder).map(drop).map_err(|error| Error::chain(error).at(&folder))
        })
    }

    /// The number of steps so far.
    fn steps(&self, py: Python<'_>) -> Result<u64> {
        Ok(self.run.lock(py)?.counters().steps)
    }

    /// The rows of the learning curve as JSON.
    fn curve(&self, py: Python<'_>) -> Result<String> {
        Ok(serde_json::to_string(self.run.lock(py)?.rows())?)
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

/// Whether a folder has checkpoints of a run.
#[pyfunction]
pub(crate) fn has_checkpoints(folder: PathBuf) -> Result<bool> {
    match learn::checkpoints(&folder) {
        Ok(checkpoints) => Ok(!checkpoints.is_empty()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(source) => {
            let error = CheckpointError::Read { path: folder.clone(), source };
            Err(Error::chain(error).at(&folder))
        }
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
    let threads = VecConfig::default().with_num_threads(num_threads.0);
    let mut signals = Signals::new();
    let summary = simulate(py, || -> Result<_> {
        let mut envs = make_vec(env, episodes.clamp(1, 16), threads)?;
        evaluate_vec_while(&mut envs, &mut policy, episodes, seed, || signals.go_on())
            .and_then(|evaluation| evaluation.summary())
            .map_err(Error::chain)
    });
    signals.finish()?;
    Ok(serde_json::to_string(&summary?)?)
}
