//! Adding steps and episodes.

use her_relabel::{
    AddError, AsStepRows, Dims, EpisodeData, HerBuffer, StartData, StepData, StepRows,
};
use pyo3::{prelude::*, types::PyMapping};

use super::Buffer;
use super::columns::{Column, FieldColumns, column, numbers};
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::vec_env::VecEnv;

#[pymethods]
impl Buffer {
    /// Stores what the last call of a vector returned, and fields of its steps.
    #[pyo3(signature = (envs, fields = None))]
    fn record(
        &self,
        py: Python<'_>,
        envs: &VecEnv,
        fields: Option<&Bound<'_, PyMapping>>,
    ) -> Result<()> {
        self.check_transitions(envs.transitions())?;
        let mut envs = envs.lock(py)?;
        let buffer = &mut self.contents.lock(py)?.buffer;
        let rows = envs.last_step()?.as_step_rows();
        let fields = FieldColumns::take(buffer.config().fields(), fields, &[rows.env_index.len()])?;
        let fields = &fields.rows();
        Ok(buffer.record(&StepRows { fields, ..rows })?.check()?)
    }

    /// Goes on recording from the states in which a vector is.
    fn resume(&self, py: Python<'_>, envs: &VecEnv) -> Result<()> {
        self.check_transitions(envs.transitions())?;
        let mut envs = envs.lock(py)?;
        let mut contents = self.contents.lock(py)?;
        Ok(contents.buffer.resume(envs.last_step()?)?.check()?)
    }

    /// Stores a whole episode of T steps: observations (T + 1, n), achieved goals (T + 1, 3), one
    /// desired goal (3), actions (T, 4) and rewards (T).
    #[pyo3(signature = (
        observation,
        achieved_goal,
        desired_goal,
        action,
        reward,
        terminated,
        truncated,
        fields = None,
    ))]
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
        fields: Option<&Bound<'_, PyMapping>>,
    ) -> Result<()> {
        let reward = column("reward", reward, "T")?;
        let steps = reward.len();
        let mut contents = self.contents.lock(py)?;
        let fields = FieldColumns::take(contents.buffer.config().fields(), fields, &[steps])?;
        let Dims { observation: width, goal, action: action_len } = self.dims;
        let episode = EpisodeData {
            observation: &numbers("observation", observation, &[steps + 1, width])?,
            achieved_goal: &numbers("achieved_goal", achieved_goal, &[steps + 1, goal])?,
            desired_goal: &numbers("desired_goal", desired_goal, &[goal])?,
            action: &numbers("action", action, &[steps, action_len])?,
            reward: &reward,
            terminated,
            truncated,
            fields: &fields.rows(),
        };
        Ok(contents.buffer.add_episode(&episode)?)
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
        Ok(self.contents.lock(py)?.buffer.begin_episode(env_index.0, &start)?)
    }

    /// Adds a step to the episode of an environment.
    #[pyo3(signature = (
        env_index,
        action,
        next_observation,
        next_achieved_goal,
        desired_goal,
        reward,
        terminated,
        truncated,
        fields = None,
    ))]
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
        fields: Option<&Bound<'_, PyMapping>>,
    ) -> Result<()> {
        let Dims { observation: width, goal, action: action_len } = self.dims;
        let desired_goal = numbers("desired_goal", desired_goal, &[goal])?;
        let buffer = &mut self.contents.lock(py)?.buffer;
        let fields = FieldColumns::take(buffer.config().fields(), fields, &[])?;
        let step = StepData {
            action: &numbers("action", action, &[action_len])?,
            next_observation: &numbers("observation", next_observation, &[width])?,
            next_achieved_goal: &numbers("achieved_goal", next_achieved_goal, &[goal])?,
            reward,
            terminated,
            truncated,
            fields: &fields.rows(),
        };
        buffer.set_desired_goal(env_index.0, &desired_goal)?;
        Ok(buffer.add_step(env_index.0, &step)?)
    }

    /// Adds a step of each environment, a row for each, with the states before it. Where that is
    /// not the last one of the episode under way, or the step has another goal, this ends, and
    /// another begins. A step that did not take place ends the one under way, and is left out.
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
        next_desired_goal: &Bound<'_, PyAny>,
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
        let next_desired_goal = column("next_desired_goal", next_desired_goal, dims.goal)?;
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
            let step = (&step, next_desired_goal.row(env_index));
            add_step_from(buffer, env_index, &start, took_place[env_index].then_some(step))?;
        }
        Ok(())
    }

    /// The number of steps of the episode that is under way; None if there is none.
    fn unfinished_steps(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<Option<usize>> {
        Ok(self.contents.lock(py)?.buffer.unfinished_steps(env_index.0)?)
    }

    /// Ends the episode that is under way, as if it were truncated.
    fn end_episode(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<()> {
        Ok(self.contents.lock(py)?.buffer.end_episode(env_index.0)?)
    }

    /// Forgets the episode that is under way.
    fn discard_episode(&self, py: Python<'_>, env_index: Integer<usize>) -> Result<()> {
        Ok(self.contents.lock(py)?.buffer.discard_episode(env_index.0)?)
    }
}

/// Adds a step that began in `start`, and its goal, to the episode under way if that is there, or to
/// a new one. Without a step, the episode ends.
fn add_step_from(
    buffer: &mut HerBuffer<f32>,
    env_index: usize,
    start: &StartData<'_, f64>,
    step: Option<(&StepData<'_, f64>, &[f64])>,
) -> Result<(), AddError> {
    let is_under_way = buffer.unfinished_steps(env_index)?.is_some();
    let Some((step, goal)) = step else {
        return if is_under_way { buffer.end_episode(env_index) } else { Ok(()) };
    };
    if is_under_way {
        let state: StepRows<'_, f64> = StepRows {
            env_index: &[env_index],
            observation: start.observation,
            achieved_goal: start.achieved_goal,
            desired_goal: start.desired_goal,
            ..StepRows::default()
        };
        // Numbers that cannot be stored are an error of what follows.
        let _ = buffer.resume(&state)?;
    }
    if buffer.unfinished_steps(env_index)?.is_none() {
        buffer.begin_episode(env_index, start)?;
    }
    buffer.set_desired_goal(env_index, goal)?;
    buffer.add_step(env_index, step)
}
