//! Section 2.7: one interface, four tasks.

use fetch_env::{Env, EnvId, GoalEnv, GoalObservation, make_with_config};
use fetch_sim::Task;
use goal_reward::RewardKind;

use crate::shared::{check::Check, json::Metric};

pub fn check(seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    let mut action_lengths = Vec::new();
    let mut thresholds = Vec::new();
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let mut env = make_with_config(id.config())?;
        let observation = env.reset(Some(seed))?.observation;
        let obs_dim = observation.observation().len();
        let ag_matches_grip = observation.achieved_goal() == observation.grip_position();
        let (expected_dim, expected_match) =
            if task.has_object() { (25, false) } else { (10, true) };
        checks.push(Check::new(
            format!("tasks/{task}"),
            obs_dim == expected_dim && ag_matches_grip == expected_match,
            format!("obs_dim={obs_dim}, ag_matches_grip={ag_matches_grip}"),
            Metric::count(obs_dim),
        ));
        action_lengths.push(env.action_space().shape().to_vec());
        thresholds.push(env.goal_reward().threshold().get());
    }
    let uniform = action_lengths.iter().all(|shape| shape[..] == [4])
        && thresholds.iter().all(|threshold| *threshold == 0.05);
    let seen = format!("action shapes {action_lengths:?}, thresholds {thresholds:?} m");
    checks.push(Check::new("tasks/interface", uniform, seen, Metric::count(action_lengths.len())));
    Ok(checks)
}
