//! A task in Python, called once for all environments of a vector.

use fetch_env::{
    EnvError, GoalPairs,
    vec_env::{Completion, VecEnv},
};
use pyo3::prelude::*;

use super::sim::{Seen, Sim};
use super::{Limited, Own};
use crate::error::{Error, Result};

/// Replaces the results of the last call by those of the task.
pub(crate) fn complete(py: Python<'_>, envs: &mut VecEnv<Limited>, own: &Own) -> Result<()> {
    let task = &own.task;
    let step = envs.last_step();
    let desired = step.desired_goal().to_vec();
    let goals = desired.chunks_exact(task.goal_len).enumerate();
    // Episodes that have not begun have no goal yet.
    let counts = |(row, goal): (usize, &[f64])| {
        step.error(row).is_none() && goal.iter().all(|number| number.is_finite())
    };
    let rows: Vec<bool> = goals.map(counts).collect();
    if !rows.contains(&true) {
        return Ok(());
    }
    let mut names = None;
    let mut seen = Vec::with_capacity(rows.len());
    for env_index in 0..envs.num_envs() {
        let env = envs.env(env_index).ok_or_else(|| Error::from(EnvError::ResetNeeded))?;
        let simulator = env.inner().simulator();
        let names = names.get_or_insert_with(|| task.names(simulator));
        seen.push(Seen::of(simulator, names)?);
    }
    let sim = Bound::new(py, Sim::of_many(names.unwrap_or_default(), seen))?;
    let observed = task.achieved_goals(&sim, &rows);
    let observed = observed.and_then(|achieved| Ok((achieved, task.extras(&sim, &rows)?)));
    sim.get().end();
    let (achieved, extra) = observed?;
    let pairs = GoalPairs::new(&achieved, &desired, task.goal_len).map_err(Error::value)?;
    let (reward, success) = (own.rewards(py, pairs, &rows)?, own.successes(py, pairs)?);
    envs.complete(&Completion {
        achieved_goal: &achieved,
        extra: &extra,
        reward: &reward,
        success: &success,
        rows: &rows,
    })?;
    Ok(())
}
