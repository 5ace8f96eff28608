//! Section 2.5: the reward three ways.

use fetch_env::{EnvId, GoalEnv, MujocoEnv};
use goal_reward::RewardKind;

use crate::shared::{check::Check, json::Metric, rewards::Comparison};

const STEPS: usize = 100;
const TOLERANCE: f64 = 1e-10;

pub fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let comparison = Comparison { steps: STEPS, goals_per_step: 0, tolerance: TOLERANCE };
    let found = comparison.run(env, seed)?;
    let threshold = env.goal_reward().threshold().get();
    let range = match id.reward {
        RewardKind::Dense => "non-positive",
        RewardKind::Sparse => "exactly 0 or -1",
    };
    Ok(vec![
        Check::none_of(
            "reward/three-ways",
            found.steps,
            format!(
                "manual = compute_reward = step over {STEPS} steps, {} mismatches at {TOLERANCE:e}",
                found.steps
            ),
        ),
        Check::none_of(
            "reward/law",
            found.bits,
            format!("step reward and compute_reward: {} differ in any bit", found.bits),
        ),
        Check::none_of(
            "reward/range",
            found.range,
            format!("every reward {range}: {} others", found.range),
        ),
        Check::new(
            "reward/threshold",
            threshold == 0.05,
            format!("distance_threshold={threshold} m"),
            Metric::new(threshold, "m"),
        ),
    ])
}
