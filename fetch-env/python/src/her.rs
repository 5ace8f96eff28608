//! The hindsight replay buffer.

use std::path::PathBuf;

use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, LoadError, Sampler, StartData,
    StepData, UnitInterval,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::arrays::Numbers;
use crate::config::Config;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::vec_env::VecEnv;

/// A hindsight replay buffer of `f32`, with the rewards of an environment.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Buffer {
    contents: Exclusive<Contents>,
    reward: DistanceReward,
}

/// The transitions, and the memory of the batches.
struct Contents {
    buffer: HerBuffer<f32>,
    batch: Batch<f32>,
}

#[pymethods]
impl Buffer {
    #[new]
    fn new(config: &Config, capacity: Integer<usize>, num_envs: Integer<usize>) -> Result<Self> {
        let dims = Dims { observation: config.observation_len(), goal: 3, action: 4 };
        let buffer = BufferConfig::new(capacity.0, dims).with_num_envs(num_envs.0);
        let buffer = HerBuffer::new(buffer).map_err(Error::value)?;
        let contents = Exclusive::new(Contents { buffer, batch: Batch::new() });
        Ok(Self { contents, reward: config.config.distance_reward() })
    }

    fn __len__(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.len())
    }

    #[getter]
    fn num_episodes(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.num_episodes())
    }

    #[getter]
    fn capacity(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.config().capacity())
    }

    #[getter]
    fn num_envs(&self, py: Python<'_>) -> Result<usize> {
        Ok(self.contents.lock(py)?.buffer.config().num_envs())
    }

    /// Stores what the last call of a vector returned.
    fn record(&self, py: Python<'_>, envs: &VecEnv) -> Result<()> {
        let mut envs = envs.lock(py)?;
        let mut contents = self.contents.lock(py)?;
        let recorded = contents.buffer.record(&envs.last_step()?.into()).map_err(Error::value)?;
        recorded.check().map_err(Error::value)
    }

    /// Goes on recording from the states in which a vector is.
    fn resume(&self, py: Python<'_>, envs: &VecEnv) -> Result<()> {
        let mut envs = envs.lock(py)?;
        let mut contents = self.contents.lock(py)?;
        let resumed = contents.buffer.resume(&envs.last_step()?.into()).map_err(Error::value)?;
        resumed.check().map_err(Error::value)
    }

    /// Stores a whole episode of T steps: observations (T + 1, n), achieved goals (T + 1, 3), one
    /// desired goal (3), actions (T, 4) and rewards (T).
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn add_episode(
        &self,
        py: Python<'_>,
        observation: &Bound<'_, PyAny>,
        achieved_goal: &Bound<'_, PyAny>,
        desired_goal: &Bound<'_, PyAny>,
        action: &Bound<'_, PyAny>,
        reward: &Bound<'_, PyAny>,
        terminated: bool,
        truncated: bool,
    ) -> Result<()> {
        let numbers = |name, array| Ok::<_, Error>(Numbers::take(name, array)?.to_double());
        let episode = EpisodeData {
            observation: &numbers("observation", observation)?,
            achieved_goal: &numbers("achieved_goal", achieved_goal)?,
            desired_goal: &numbers("desired_goal", desired_goal)?,
            action: &numbers("action", action)?,
            reward: &numbers("reward", reward)?,
            terminated,
            truncated,
            fields: &[],
        };
        self.contents.lock(py)?.buffer.add_episode(&episode).map_err(Error::value)
    }

    /// Begins an episode of an environment.
    fn begin_episode(
        &self,
        py: Python<'_>,
        env_index: Integer<usize>,
        observation: &Bound<'_, PyAny>,
        achieved_goal: &Bound<'_, PyAny>,
        desired_goal: &Bound<'_, PyAny>,
    ) -> Result<()> {
        let start = StartData {
            observation: &Numbers::take("observation", observation)?.to_double(),
            achieved_goal: &Numbers::take("achieved_goal", achieved_goal)?.to_double(),
            desired_goal: &Numbers::take("desired_goal", desired_goal)?.to_double(),
        };
        self.contents.lock(py)?.buffer.begin_episode(env_index.0, &start).map_err(Error::value)
    }

    /// Adds a step to the episode of an environment.
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn add_step(
        &self,
        py: Python<'_>,
        env_index: Integer<usize>,
        action: &Bound<'_, PyAny>,
        next_observation: &Bound<'_, PyAny>,
        next_achieved_goal: &Bound<'_, PyAny>,
        reward: f64,
        terminated: bool,
        truncated: bool,
    ) -> Result<()> {
        let step = StepData {
            action: &Numbers::take("action", action)?.to_double(),
            next_observation: &Numbers::take("observation", next_observation)?.to_double(),
            next_achieved_goal: &Numbers::take("achieved_goal", next_achieved_goal)?.to_double(),
            reward,
            terminated,
            truncated,
            fields: &[],
        };
        self.contents.lock(py)?.buffer.add_step(env_index.0, &step).map_err(Error::value)
    }

    /// The number of steps of the episode that is under way; None if there is none.
    fn unfinished_steps(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<Option<usize>> {
        self.contents.lock(py)?.buffer.unfinished_steps(env_index.0).map_err(Error::value)
    }

    /// Ends the episode that is under way, as if it were truncated.
    fn end_episode(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<()> {
        self.contents.lock(py)?.buffer.end_episode(env_index.0).map_err(Error::value)
    }

    /// Forgets the episode that is under way.
    fn discard_episode(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<()> {
        self.contents.lock(py)?.buffer.discard_episode(env_index.0).map_err(Error::value)
    }

    /// Draws a batch: arrays with a row for each transition.
    fn sample<'py>(
        &self,
        py: Python<'py>,
        batch_size: Integer<usize>,
        strategy: &str,
        ratio: f64,
        seed: Integer<u64>,
    ) -> Result<Bound<'py, PyDict>> {
        let (Integer(batch_size), Integer(seed)) = (batch_size, seed);
        let strategy = match strategy {
            "future" => GoalStrategy::Future,
            "final" => GoalStrategy::Final,
            "episode" => GoalStrategy::Episode,
            "random" => GoalStrategy::Random,
            _ => {
                return Err(Error::value(format!(
                    "there is no goal strategy {strategy:?}: pass \"future\", \"final\", \
                     \"episode\" or \"random\""
                )));
            }
        };
        let ratio = UnitInterval::new(ratio).map_err(Error::value)?;
        let sampler = Sampler::new(batch_size, strategy, ratio);
        let mut contents = self.contents.lock(py)?;
        let Contents { buffer, batch } = &mut *contents;
        py.detach(|| sampler.sample(buffer, &self.reward, seed, batch)).map_err(Error::value)?;
        let relabeled: Vec<bool> = batch.relabeled().collect();
        let columns = batch.take_columns();
        drop(contents);
        let dict = PyDict::new(py);
        for (key, numbers) in [
            ("observation", columns.observation),
            ("achieved_goal", columns.achieved_goal),
            ("desired_goal", columns.desired_goal),
            ("action", columns.action),
            ("next_observation", columns.next_observation),
            ("next_achieved_goal", columns.next_achieved_goal),
        ] {
            let shape = [batch_size, numbers.len() / batch_size];
            dict.set_item(key, PyArray1::from_vec(py, numbers).reshape(shape)?)?;
        }
        dict.set_item("reward", PyArray1::from_vec(py, columns.reward))?;
        for (key, flags) in [
            ("terminated", columns.terminated),
            ("truncated", columns.truncated),
            ("relabeled", relabeled),
        ] {
            dict.set_item(key, PyArray1::from_vec(py, flags))?;
        }
        Ok(dict)
    }

    /// Removes all transitions.
    fn clear(&self, py: Python<'_>) -> Result<()> {
        self.contents.lock(py)?.buffer.clear();
        Ok(())
    }

    /// Writes all episodes to a file.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<()> {
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        Ok(py.detach(|| buffer.save(path)).map_err(PyErr::from)?)
    }

    /// Reads a file that `save` wrote.
    fn load(&self, py: Python<'_>, path: PathBuf) -> Result<()> {
        let read = py.detach(|| HerBuffer::load(path));
        self.take(
            py,
            read.map_err(|error| match error {
                LoadError::Io(error) => PyErr::from(error).into(),
                error => Error::value(error),
            })?,
        )
    }

    /// All episodes, as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        py.detach(|| buffer.write_to(&mut bytes)).map_err(PyErr::from)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Reads bytes that `to_bytes` returned.
    fn set_bytes(&self, py: Python<'_>, bytes: &[u8]) -> Result<()> {
        let read = py.detach(|| HerBuffer::read_from(bytes)).map_err(Error::value)?;
        self.take(py, read)
    }
}

impl Buffer {
    /// Takes the contents of a buffer that was read.
    fn take(&self, py: Python<'_>, read: HerBuffer<f32>) -> Result<()> {
        let mut contents = self.contents.lock(py)?;
        let (theirs, ours) = (read.config().dims(), contents.buffer.config().dims());
        if theirs != ours {
            return Err(Error::value(format!("the buffer has {theirs:?}, this one has {ours:?}")));
        }
        contents.buffer = read;
        Ok(())
    }
}
