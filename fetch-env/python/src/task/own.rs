//! A task that is a Python object.

use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use fetch_env::rand_core::Rng;
use fetch_env::{EnvError, Extension, GoalReward, MujocoSimulator, NpRandom};
use goal_reward::GoalPairs;
use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::{intern, prelude::*};
use serde::de::DeserializeOwned;

use super::Own;
use super::sim::{Seen, Sim};
use crate::arrays::Numbers;
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::mirror::TaskMirror;

/// A Python object with the methods of `fetch_env.Task`. Those that it lacks are the settings'.
pub(crate) struct OwnTask {
    object: Py<PyAny>,
    /// The name of its class.
    name: String,
    pub(crate) goal_len: usize,
    pub(crate) extra_len: usize,
    has_reward: bool,
    has_success: bool,
    range: Option<(f64, f64)>,
    /// How it looks in a mirror, if it says so.
    pub(crate) mirror: Option<TaskMirror>,
    /// The names of the bodies that it sees.
    names: OnceLock<Arc<[String]>>,
    /// The first exception of a reward, for which the trait has no place.
    error: Mutex<Option<PyErr>>,
}

impl Display for OwnTask {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl OwnTask {
    pub(crate) fn new(task: &Bound<'_, PyAny>) -> Result<Self> {
        let Integer(goal_len): Integer<usize> = task.getattr("goal_len")?.extract()?;
        let Integer(extra_len): Integer<usize> = match task.getattr_opt("extra_len")? {
            Some(len) => len.extract()?,
            None => Integer(0),
        };
        let mirror: Option<TaskMirror> = described(task, "mirror")?;
        if let Some(mirror) = &mirror {
            mirror.check(goal_len, extra_len)?;
        }
        Ok(Self {
            object: task.clone().unbind(),
            name: task.get_type().qualname()?.to_string(),
            goal_len,
            extra_len,
            has_reward: task.hasattr("compute_reward")?,
            has_success: task.hasattr("is_success")?,
            range: match task.getattr_opt("reward_range")? {
                Some(range) => Some(range.extract()?),
                None => None,
            },
            mirror,
            names: OnceLock::new(),
            error: Mutex::new(None),
        })
    }

    /// Reads what a task changes in the built-in model.
    pub(crate) fn extension(task: &Bound<'_, PyAny>) -> Result<Option<Extension>> {
        described(task, "extension")
    }

    /// Returns the name of its class.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// Raises the exception of a reward, if there was one since the last call.
    pub(crate) fn check(&self) -> Result<()> {
        let error = self.error.lock().unwrap_or_else(PoisonError::into_inner).take();
        error.map_or(Ok(()), |error| Err(error.into()))
    }

    /// Returns the names of the bodies that the task sees, which all its environments share.
    pub(super) fn names(&self, simulator: &MujocoSimulator) -> Arc<[String]> {
        let names = || simulator.object_names().map(str::to_owned).collect();
        Arc::clone(self.names.get_or_init(names))
    }

    pub(super) fn begin_episode(
        &self,
        simulator: &mut MujocoSimulator,
        random: &mut NpRandom,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        let seed = random.next_u64();
        let names = self.names(simulator);
        let seen = Seen::of(simulator, &names)?;
        let begin = |py: Python<'_>| -> Result<_> {
            let sim = Bound::new(py, Sim::of_one(names, seen))?;
            let random = py.import(intern!(py, "numpy.random"))?;
            let rng = random.call_method1(intern!(py, "default_rng"), (seed,))?;
            let name = intern!(py, "begin_episode");
            let drawn = self.object.bind(py).call_method1(name, (&sim, rng))?;
            let numbers = Numbers::of_shape("begin_episode()'s goal", &drawn, &[self.goal_len])?;
            let places = sim.get().end();
            Ok((numbers.to_double(), places))
        };
        let (drawn, places) = Python::attach(begin).map_err(raised)?;
        goal.copy_from_slice(&drawn);
        for place in places {
            simulator.place_object(&place.name, place.position, place.rotation)?;
        }
        Ok(())
    }

    pub(super) fn achieved_goal(
        &self,
        simulator: &MujocoSimulator,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        self.see(simulator, |sim| self.achieved_goals(sim, &[true]), goal)
    }

    pub(super) fn observe_extra(
        &self,
        simulator: &MujocoSimulator,
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        if self.extra_len == 0 {
            return Ok(());
        }
        self.see(simulator, |sim| self.extras(sim, &[true]), extra)
    }

    /// Writes what a method returns for the state of one environment.
    fn see(
        &self,
        simulator: &MujocoSimulator,
        call: impl FnOnce(&Bound<'_, Sim>) -> Result<Vec<f64>>,
        out: &mut [f64],
    ) -> Result<(), EnvError> {
        let names = self.names(simulator);
        let seen = Seen::of(simulator, &names)?;
        let call = |py: Python<'_>| {
            let sim = Bound::new(py, Sim::of_many(names, vec![seen]))?;
            let numbers = call(&sim);
            sim.get().end();
            numbers
        };
        out.copy_from_slice(&Python::attach(call).map_err(raised)?);
        Ok(())
    }

    /// Returns the goals that the states achieve, row after row. Those of the `rows` that count must
    /// be finite.
    pub(super) fn achieved_goals(&self, sim: &Bound<'_, Sim>, rows: &[bool]) -> Result<Vec<f64>> {
        let goals =
            self.object.bind(sim.py()).call_method1(intern!(sim.py(), "achieved_goal"), (sim,))?;
        finite("achieved_goal()", &goals, rows, &[rows.len(), self.goal_len])
    }

    /// Returns what is observed besides, row after row.
    pub(super) fn extras(&self, sim: &Bound<'_, Sim>, rows: &[bool]) -> Result<Vec<f64>> {
        if self.extra_len == 0 {
            return Ok(Vec::new());
        }
        let extra =
            self.object.bind(sim.py()).call_method1(intern!(sim.py(), "observe_extra"), (sim,))?;
        finite("observe_extra()", &extra, rows, &[rows.len(), self.extra_len])
    }

    fn keep<T>(&self, result: Result<T>) -> Option<T> {
        let keep = |error: Error| {
            let mut first = self.error.lock().unwrap_or_else(PoisonError::into_inner);
            first.get_or_insert(error.into());
        };
        result.map_err(keep).ok()
    }
}

impl Own {
    /// Returns the rewards of pairs of goals, those of the `rows` that count finite.
    pub(super) fn rewards(
        &self,
        py: Python<'_>,
        pairs: GoalPairs<'_>,
        rows: &[bool],
    ) -> Result<Vec<f64>> {
        let Self { task, settings, .. } = self;
        if !task.has_reward {
            return Ok(pairs.iter().map(|(a, d)| settings.reward(a, d)).collect());
        }
        let [achieved, desired] = arrays(py, pairs)?;
        let name = intern!(py, "compute_reward");
        let rewards = task.object.bind(py).call_method1(name, (achieved, desired, py.None()))?;
        finite("compute_reward()", &rewards, rows, &[rows.len()])
    }

    /// Returns whether the achieved goals count as the desired ones.
    pub(super) fn successes(&self, py: Python<'_>, pairs: GoalPairs<'_>) -> Result<Vec<bool>> {
        let Self { task, settings, .. } = self;
        if !task.has_success {
            return Ok(pairs.iter().map(|(a, d)| settings.is_success(a, d)).collect());
        }
        let [achieved, desired] = arrays(py, pairs)?;
        let name = intern!(py, "is_success");
        let successes = task.object.bind(py).call_method1(name, (achieved, desired))?;
        // numpy takes longer to make numbers of them than most tasks take to judge.
        if let Ok(flags) = successes.cast::<PyArray1<bool>>()
            && flags.len() == pairs.len()
        {
            return Ok(flags.try_readonly().map_err(Error::value)?.as_array().to_vec());
        }
        let successes = Numbers::of_shape("is_success()", &successes, &[pairs.len()])?;
        Ok(successes.to_double().iter().map(|success| *success != 0.0).collect())
    }

    /// Writes the rewards of a batch: NaN if there is an exception, which is kept.
    pub(super) fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) {
        let rewards = Python::attach(|py| self.rewards(py, pairs, &vec![true; pairs.len()]));
        match self.task.keep(rewards) {
            Some(rewards) => out.copy_from_slice(&rewards),
            None => out.fill(f64::NAN),
        }
    }

    /// Writes the successes of a batch: none if there is an exception, which is kept.
    pub(super) fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) {
        match self.task.keep(Python::attach(|py| self.successes(py, pairs))) {
            Some(successes) => out.copy_from_slice(&successes),
            None => out.fill(false),
        }
    }

    /// Returns the range of the rewards.
    pub(super) fn bounds(&self) -> RangeInclusive<f64> {
        match (self.task.range, self.task.has_reward) {
            (Some((least, most)), _) => least..=most,
            (None, true) => f64::NEG_INFINITY..=f64::INFINITY,
            (None, false) => self.settings.bounds(),
        }
    }
}

/// Reads an attribute of dictionaries, lists, names and numbers.
fn described<T: DeserializeOwned>(task: &Bound<'_, PyAny>, name: &str) -> Result<Option<T>> {
    let Some(value) = task.getattr_opt(name)? else { return Ok(None) };
    let json: String = task.py().import("json")?.call_method1("dumps", (value,))?.extract()?;
    let wrong = |error| Error::value(format!("the task's {name}: {error}"));
    serde_json::from_str(&json).map(Some).map_err(wrong)
}

/// Returns the achieved and the desired goals as new arrays.
fn arrays<'py>(py: Python<'py>, pairs: GoalPairs<'_>) -> Result<[Bound<'py, PyAny>; 2]> {
    let array = |goals: &[f64]| -> Result<_> {
        let rows = PyArray1::from_slice(py, goals).reshape([pairs.len(), pairs.dim()])?;
        Ok(rows.into_any())
    };
    Ok([array(pairs.achieved())?, array(pairs.desired())?])
}

/// Reads an array of this shape, whose `rows` that count are finite.
fn finite(
    what: &str,
    numbers: &Bound<'_, PyAny>,
    rows: &[bool],
    shape: &[usize],
) -> Result<Vec<f64>> {
    let numbers = Numbers::of_shape(what, numbers, shape)?.to_double();
    let len = (numbers.len() / rows.len()).max(1);
    for (row, _) in rows.iter().enumerate().filter(|(_, counts)| **counts) {
        let numbers = &numbers[row * len..][..len];
        if let Some(number) = numbers.iter().find(|number| !number.is_finite()) {
            return Err(Error::value(format!(
                "{what} returned {number:?} for environment {row}: return finite numbers"
            )));
        }
    }
    Ok(numbers)
}

/// Wraps an exception, which reaches the caller as it is.
fn raised(error: Error) -> EnvError {
    EnvError::other(PyErr::from(error))
}
