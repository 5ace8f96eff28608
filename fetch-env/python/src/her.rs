//! The hindsight replay buffer.

use std::path::PathBuf;

use goal_reward::{DistanceReward, GoalReward};
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, Sampler, StartData, StepData,
    UnitInterval,
};
use pyo3::{
    prelude::*,
    types::{PyBytes, PyDict},
};

use crate::arrays::{Numbers, Shape};
use crate::batch::columns_of;
use crate::config::{Config, GOAL_LEN};
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::own_reward::OwnReward;
use crate::steps::{Column, add_step_from};
use crate::vec_env::VecEnv;

/// The number of elements of an action.
const ACTION_LEN: usize = 4;

/// A hindsight replay buffer of `f32`, with the rewards of an environment.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Buffer {
    contents: Exclusive<Contents>,
    reward: DistanceReward,
    dims: Dims,
    /// The kind of transitions that the environments have; see [`Config::transitions`].
    transitions: String,
    /// The description of the contents in a file: the same, and whose rewards relabeled rows get.
    task: String,
    /// The number of steps after which an episode is cut off, if it is known.
    episode_len: Option<usize>,
}

/// The transitions, and the memory of the batches.
struct Contents {
    buffer: HerBuffer<f32>,
    batch: Batch<f32>,
}

#[pymethods]
impl Buffer {
    /// `episode_len` is the number of steps after which an episode is cut off; `has_own_reward` says
    /// whether `sample` will get a function.
    #[new]
    #[pyo3(signature = (config, capacity, num_envs, episode_len = None, has_own_reward = false))]
    fn new(
        config: &Config,
        capacity: Integer<usize>,
        num_envs: Integer<usize>,
        episode_len: Option<usize>,
        has_own_reward: bool,
    ) -> Result<Self> {
        let dims =
            Dims { observation: config.observation_len(), goal: GOAL_LEN, action: ACTION_LEN };
        let transitions = config.transitions();
        let own = if has_own_reward { ", relabeled by another function" } else { "" };
        let task = format!("{transitions}{own}");
        check_capacity(capacity.0, episode_len)?;
        let buffer = BufferConfig::new(capacity.0, dims).with_num_envs(num_envs.0).with_task(&task);
        let buffer = HerBuffer::new(buffer).map_err(Error::value)?;
        let contents = Exclusive::new(Contents { buffer, batch: Batch::new() });
        let reward = config.config.distance_reward();
        Ok(Self { contents, reward, dims, transitions, task, episode_len })
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
        self.check_transitions(envs.transitions())?;
        let mut envs = envs.lock(py)?;
        let mut contents = self.contents.lock(py)?;
        let recorded = contents.buffer.record(&envs.last_step()?.into()).map_err(Error::value)?;
        recorded.check().map_err(Error::value)
    }

    /// Goes on recording from the states in which a vector is.
    fn resume(&self, py: Python<'_>, envs: &VecEnv) -> Result<()> {
        self.check_transitions(envs.transitions())?;
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
        let reward = Numbers::take("reward", reward)?;
        let &[steps] = reward.shape() else {
            let shape = Shape(reward.shape());
            return Err(Error::value(format!("reward has the shape {shape}: pass (T,)")));
        };
        let Dims { observation: width, goal, action: action_len } = self.dims;
        let episode = EpisodeData {
            observation: &numbers("observation", observation, &[steps + 1, width])?,
            achieved_goal: &numbers("achieved_goal", achieved_goal, &[steps + 1, goal])?,
            desired_goal: &numbers("desired_goal", desired_goal, &[goal])?,
            action: &numbers("action", action, &[steps, action_len])?,
            reward: &reward.to_double(),
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
        let Dims { observation: width, goal, .. } = self.dims;
        let start = StartData {
            observation: &numbers("observation", observation, &[width])?,
            achieved_goal: &numbers("achieved_goal", achieved_goal, &[goal])?,
            desired_goal: &numbers("desired_goal", desired_goal, &[goal])?,
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
        desired_goal: &Bound<'_, PyAny>,
        reward: f64,
        terminated: bool,
        truncated: bool,
    ) -> Result<()> {
        let Dims { observation: width, goal, action: action_len } = self.dims;
        let desired_goal = numbers("desired_goal", desired_goal, &[goal])?;
        let step = StepData {
            action: &numbers("action", action, &[action_len])?,
            next_observation: &numbers("observation", next_observation, &[width])?,
            next_achieved_goal: &numbers("achieved_goal", next_achieved_goal, &[goal])?,
            reward,
            terminated,
            truncated,
            fields: &[],
        };
        let buffer = &mut self.contents.lock(py)?.buffer;
        let of_episode = buffer.unfinished_goal(env_index.0).map_err(Error::value)?;
        let is_same = |of_episode: &[f32]| {
            of_episode.iter().zip(&desired_goal).all(|(kept, goal)| *kept == *goal as f32)
        };
        if !of_episode.is_none_or(is_same) {
            return Err(Error::value(
                "desired_goal is not that of the episode under way, which has one goal: call \
                 end_episode(), and begin_episode() with the observation that has the new goal",
            ));
        }
        buffer.add_step(env_index.0, &step).map_err(Error::value)
    }

    /// Adds a step of each environment, a row for each, with the states before it. Where that is
    /// not the last one of the episode under way, this ends, and another begins. A step that did
    /// not take place ends the one under way, and is left out.
    #[expect(clippy::too_many_arguments, reason = "they are columns")]
    fn add_steps(
        &self,
        py: Python<'_>,
        observation: &Bound<'_, PyAny>,
        achieved_goal: &Bound<'_, PyAny>,
        desired_goal: &Bound<'_, PyAny>,
        action: &Bound<'_, PyAny>,
        next_observation: &Bound<'_, PyAny>,
        next_achieved_goal: &Bound<'_, PyAny>,
        reward: &Bound<'_, PyAny>,
        terminated: Vec<bool>,
        truncated: Vec<bool>,
        took_place: Vec<bool>,
    ) -> Result<()> {
        let mut contents = self.contents.lock(py)?;
        let buffer = &mut contents.buffer;
        let (rows, dims) = (buffer.config().num_envs(), buffer.config().dims());
        let column = |name, array, len| Column::take(name, array, rows, len);
        let observation = column("observation", observation, dims.observation)?;
        let achieved_goal = column("achieved_goal", achieved_goal, dims.goal)?;
        let desired_goal = column("desired_goal", desired_goal, dims.goal)?;
        let action = column("action", action, dims.action)?;
        let next_observation = column("next_observation", next_observation, dims.observation)?;
        let next_achieved_goal = column("next_achieved_goal", next_achieved_goal, dims.goal)?;
        let reward = numbers("reward", reward, &[rows])?;
        for (name, flags) in
            [("terminated", &terminated), ("truncated", &truncated), ("took_place", &took_place)]
        {
            if flags.len() != rows {
                let len = flags.len();
                return Err(Error::value(format!("{name} has {len} elements: pass {rows}")));
            }
        }
        for env_index in 0..rows {
            let start = StartData {
                observation: observation.row(env_index),
                achieved_goal: achieved_goal.row(env_index),
                desired_goal: desired_goal.row(env_index),
            };
            let step = StepData {
                action: action.row(env_index),
                next_observation: next_observation.row(env_index),
                next_achieved_goal: next_achieved_goal.row(env_index),
                reward: reward[env_index],
                terminated: terminated[env_index],
                truncated: truncated[env_index],
                fields: &[],
            };
            let step = took_place[env_index].then_some(&step);
            add_step_from(buffer, env_index, &start, step).map_err(Error::value)?;
        }
        Ok(())
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

    /// Draws a batch: arrays with a row for each transition. The new goals have the rewards of the
    /// settings, or of a function of whole batches: achieved goals, desired goals and infos.
    #[pyo3(signature = (batch_size, strategy, ratio, seed, reward = None))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        batch_size: Integer<usize>,
        strategy: &str,
        ratio: f64,
        seed: Integer<u64>,
        reward: Option<Py<PyAny>>,
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
        let mut draw = |reward: &(dyn GoalReward + Sync)| {
            let drawn = py.detach(|| sampler.sample(buffer, reward, seed, batch));
            drawn.map_err(Error::value)
        };
        match &reward {
            None => draw(&self.reward)?,
            Some(function) => {
                let own = OwnReward::new(function, self.reward);
                draw(&own).map_err(|error| own.into_error().unwrap_or(error))?;
            }
        }
        let relabeled: Vec<bool> = batch.relabeled().collect();
        let columns = batch.take_columns();
        drop(contents);
        columns_of(py, batch_size, columns, relabeled)
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
        py.detach(|| buffer.save(&path)).map_err(|error| Error::chain(error).at(&path))
    }

    /// Reads a file that `save` wrote, and returns whether it says what it holds.
    fn load(&self, py: Python<'_>, path: PathBuf) -> Result<bool> {
        let read = py.detach(|| HerBuffer::load(&path));
        self.take(py, read.map_err(|error| Error::chain(error).at(&path))?)
    }

    /// All episodes, as bytes.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let mut bytes = Vec::new();
        let contents = self.contents.lock(py)?;
        let buffer = &contents.buffer;
        py.detach(|| buffer.write_to(&mut bytes)).map_err(PyErr::from)?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Reads bytes that `to_bytes` returned, and returns whether they say what they hold.
    fn set_bytes(&self, py: Python<'_>, bytes: &[u8]) -> Result<bool> {
        let read = py.detach(|| HerBuffer::read_from(bytes)).map_err(Error::value)?;
        self.take(py, read)
    }

    /// Raises an error if environments with these settings have transitions of another kind.
    fn check_kind(&self, config: &Config) -> Result<()> {
        self.check_transitions(&config.transitions())
    }

    /// The kind of transitions that it holds.
    #[getter]
    fn task(&self) -> &str {
        &self.task
    }
}

impl Buffer {
    fn check_transitions(&self, theirs: &str) -> Result<()> {
        let ours = &self.transitions;
        if theirs == ours {
            return Ok(());
        }
        Err(Error::value(format!(
            "the environments have transitions of another kind ({theirs}) than the buffer \
             ({ours}): use a buffer that was made for them"
        )))
    }

    /// Takes the contents of a buffer that was read, and returns whether it says what they are.
    fn take(&self, py: Python<'_>, read: HerBuffer<f32>) -> Result<bool> {
        let (theirs, ours) = (read.config(), &self.task);
        let is_described = !theirs.task().is_empty();
        if is_described && theirs.task() != ours {
            return Err(Error::value(format!(
                "the file holds transitions of another kind ({}) than the buffer ({ours}): load it \
                 into a buffer that was made for them",
                theirs.task(),
            )));
        }
        if theirs.dims() != self.dims {
            let (theirs, ours) = (theirs.dims(), self.dims);
            return Err(Error::value(format!("the file has {theirs:?}, the buffer has {ours:?}")));
        }
        check_capacity(theirs.capacity(), self.episode_len)?;
        self.contents.lock(py)?.buffer = read;
        Ok(is_described)
    }
}

/// Takes an array of this shape in double precision.
fn numbers(name: &str, array: &Bound<'_, PyAny>, shape: &[usize]) -> Result<Vec<f64>> {
    Ok(Numbers::of_shape(name, array, shape)?.to_double())
}

/// Checks that a whole episode fits: of a longer one, only the last steps would be kept.
fn check_capacity(capacity: usize, episode_len: Option<usize>) -> Result<()> {
    match episode_len.filter(|steps| capacity < *steps) {
        None => Ok(()),
        Some(steps) => Err(Error::value(format!(
            "the capacity is {capacity} transitions, but an episode has up to {steps} steps: pass \
             at least {steps}"
        ))),
    }
}
