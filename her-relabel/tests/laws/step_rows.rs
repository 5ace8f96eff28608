//! Rows of vectorized environments whose numbers tell where they belong.

use her_relabel::{AddError, BufferConfig, HerBuffer, Recorded, StepRows};

use crate::common::{DIMS, Result, achieved_goal, action, desired_goal, observation, reward};

pub(crate) const NUM_ENVS: usize = 4;

/// The contents of a row.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub(crate) env: usize,
    /// The episode and the state before the step, and whether it is terminated and truncated.
    pub(crate) step: Option<(u32, u32)>,
    pub(crate) terminated: bool,
    pub(crate) truncated: bool,
    /// The episode that starts.
    pub(crate) start: Option<u32>,
    /// Whether the numbers of the step or of the start are not finite.
    pub(crate) bad_step: bool,
    pub(crate) bad_start: bool,
}

/// The columns of some rows. Whatever must not be read is NaN.
#[derive(Default)]
pub(crate) struct Columns {
    env_ids: Vec<usize>,
    stepped: Vec<bool>,
    started: Vec<bool>,
    actions: Vec<f32>,
    rewards: Vec<f64>,
    next_observations: Vec<f64>,
    next_achieved_goals: Vec<f64>,
    terminated: Vec<bool>,
    truncated: Vec<bool>,
    observations: Vec<f64>,
    achieved_goals: Vec<f64>,
    desired_goals: Vec<f64>,
}

impl Columns {
    pub(crate) fn new(rows: &[Row]) -> Self {
        let mut columns = Self::default();
        for row in rows {
            columns.env_ids.push(row.env);
            columns.stepped.push(row.step.is_some());
            columns.started.push(row.start.is_some());
            columns.terminated.push(row.terminated);
            columns.truncated.push(row.truncated);
            let (episode, t) = row.step.unwrap_or_default();
            let read = |value| if row.step.is_some() { value } else { f64::NAN };
            columns.actions.extend(action(episode, t).map(|value| read(value) as f32));
            columns.rewards.push(if row.bad_step { f64::NAN } else { read(reward(episode, t)) });
            columns.next_observations.extend(observation(episode, t + 1).map(read));
            columns.next_achieved_goals.extend(achieved_goal(episode, t + 1).map(read));
            let episode = row.start.unwrap_or_default();
            let read = |value| if row.start.is_some() { value } else { f64::NAN };
            columns.observations.extend(observation(episode, 0).map(read));
            columns.achieved_goals.extend(achieved_goal(episode, 0).map(read));
            let goal = desired_goal(episode);
            columns
                .desired_goals
                .extend(goal.map(|value| if row.bad_start { f64::INFINITY } else { read(value) }));
        }
        columns
    }

    pub(crate) fn rows(&self) -> StepRows<'_, f64, f64, f32> {
        StepRows {
            env_index: &self.env_ids,
            stepped: &self.stepped,
            started: &self.started,
            action: &self.actions,
            reward: &self.rewards,
            next_observation: &self.next_observations,
            next_achieved_goal: &self.next_achieved_goals,
            terminated: &self.terminated,
            truncated: &self.truncated,
            observation: &self.observations,
            achieved_goal: &self.achieved_goals,
            desired_goal: &self.desired_goals,
            ..StepRows::default()
        }
    }
}

pub(crate) fn record(buffer: &mut HerBuffer<f64>, rows: &[Row]) -> Result<Recorded, AddError> {
    buffer.record(&Columns::new(rows).rows())
}

/// Records rows whose numbers can be stored.
pub(crate) fn record_all(buffer: &mut HerBuffer<f64>, rows: &[Row]) -> Result {
    Ok(record(buffer, rows)?.check()?)
}

pub(crate) fn buffer() -> HerBuffer<f64> {
    HerBuffer::new(BufferConfig::new(40, DIMS).with_num_envs(NUM_ENVS)).unwrap()
}

pub(crate) fn saved(buffer: &HerBuffer<f64>) -> Vec<u8> {
    let mut bytes = Vec::new();
    buffer.write_to(&mut bytes).unwrap();
    bytes
}

pub(crate) fn reset_row(env: usize, episode: u32) -> Row {
    Row { env, start: Some(episode), ..Row::default() }
}

pub(crate) fn step_row(env: usize, state: (u32, u32)) -> Row {
    Row { env, step: Some(state), ..Row::default() }
}
