//! Section 2.5: the reward three ways.

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, EnvId, GoalEnv, GoalEnvExt, GoalObservation, MujocoEnv};
use goal_reward::RewardKind;

use super::goals::expected_reward;
use crate::{check::Check, report::Figure};

const STEPS: usize = 100;
const TOLERANCE: f64 = 1e-10;

pub fn check(id: EnvId, env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut policy = RandomPolicy::new(seed);
    let mut observation = env.reset(Some(seed))?.observation;
    let (mut mismatches, mut bit_differences, mut out_of_range) = (0, 0, 0);
    for t in 0..STEPS as u64 {
        let step = env.step(&policy.act(&observation))?;
        observation = step.observation;
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        let manual = expected_reward(env.goal_reward(), achieved, desired);
        let computed = env.compute_reward(achieved, desired)?;
        if (manual - computed).abs() > TOLERANCE || (manual - step.reward).abs() > TOLERANCE {
            mismatches += 1;
        }
        if computed.to_bits() != step.reward.to_bits() {
            bit_differences += 1;
        }
        let in_range = match id.reward {
            RewardKind::Dense => step.reward <= 0.0,
            RewardKind::Sparse => step.reward == 0.0 || step.reward == -1.0,
        };
        if !in_range {
            out_of_range += 1;
        }
        if step.is_last() {
            observation = env.reset(Some(seed + t + 1))?.observation;
        }
    }
    let threshold = env.goal_reward().threshold().get();
    let range = match id.reward {
        RewardKind::Dense => "non-positive",
        RewardKind::Sparse => "exactly 0 or -1",
    };
    Ok(vec![
        Check::none_of(
            "reward/three-ways",
            mismatches,
            format!(
                "manual = compute_reward = step over {STEPS} steps, {mismatches} mismatches at {TOLERANCE:e}"
            ),
        ),
        Check::none_of(
            "reward/law",
            bit_differences,
            format!("step reward and compute_reward: {bit_differences} differ in any bit"),
        ),
        Check::none_of(
            "reward/range",
            out_of_range,
            format!("every reward {range}: {out_of_range} others"),
        ),
        Check::new(
            "reward/threshold",
            threshold == 0.05,
            format!("distance_threshold={threshold} m"),
            Figure::new(threshold, "m"),
        ),
    ])
}
