//! Steps of several environments, each with the state in which it began.

use her_relabel::{AddError, HerBuffer, StartData, StepData, StepRows};
use pyo3::prelude::*;

use crate::arrays::Numbers;
use crate::error::Result;

/// Numbers of several rows.
pub(crate) struct Column {
    numbers: Vec<f64>,
    len: usize,
}

impl Column {
    pub(crate) fn take(
        name: &str,
        array: &Bound<'_, PyAny>,
        rows: usize,
        len: usize,
    ) -> Result<Self> {
        Ok(Self { numbers: Numbers::of_shape(name, array, &[rows, len])?.to_double(), len })
    }

    pub(crate) fn row(&self, at: usize) -> &[f64] {
        &self.numbers[at * self.len..][..self.len]
    }
}

/// Adds a step that began in `start`, to the episode under way if that is there, or to a new one.
/// Without a step, the episode ends.
pub(crate) fn add_step_from(
    buffer: &mut HerBuffer<f32>,
    env_index: usize,
    start: &StartData<'_, f64>,
    step: Option<&StepData<'_, f64>>,
) -> std::result::Result<(), AddError> {
    let is_under_way = buffer.unfinished_steps(env_index)?.is_some();
    let Some(step) = step else {
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
    buffer.add_step(env_index, step)
}
