//! Rows of vectorized environments.

use her_relabel::{AddError, HerBuffer, Recorded, Scalar, StepRows};

use crate::common::fields;

/// A row of a vectorized environment: the step of an episode, and the episode that starts.
#[derive(Clone, Copy, Default)]
pub struct Row {
    pub step: Option<(u8, u8)>,
    pub ends: bool,
    pub start: Option<u8>,
    pub is_finite: bool,
}

/// Records a row of each environment.
pub fn record<T: Scalar>(buffer: &mut HerBuffer<T>, rows: &[Row]) -> Result<Recorded, AddError> {
    let column = |of: &dyn Fn(&Row) -> Vec<f64>| -> Vec<f64> { rows.iter().flat_map(of).collect() };
    let flags = |of: &dyn Fn(&Row) -> bool| -> Vec<bool> { rows.iter().map(of).collect() };
    let step = |row: &Row| row.step.map_or((0.0, 0.0), |(episode, t)| (episode.into(), t.into()));
    let start = |row: &Row| f64::from(row.start.unwrap_or_default());
    let t = column(&|row| vec![step(row).1]);
    let next = column(&|row| vec![if row.is_finite { step(row).1 + 1.0 } else { f64::NAN }]);
    buffer.record(&StepRows {
        env_index: &(0..rows.len()).collect::<Vec<_>>(),
        stepped: &flags(&|row| row.step.is_some()),
        started: &flags(&|row| row.start.is_some()),
        action: &t,
        reward: &column(&|row| vec![step(row).0]),
        next_observation: &column(&|row| vec![step(row).0, step(row).1 + 1.0]),
        next_achieved_goal: &next,
        terminated: &vec![false; rows.len()],
        truncated: &flags(&|row| row.ends),
        observation: &column(&|row| vec![start(row), 0.0]),
        achieved_goal: &vec![0.0; rows.len()],
        desired_goal: &column(&|row| vec![start(row)]),
        fields: &fields(buffer, &t),
        numbers: None,
    })
}
