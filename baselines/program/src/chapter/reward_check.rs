//! `reward-check`: checks that step, compute_reward and the formula agree, also for relabeled
//! goals.

use fetch_env::{EnvId, make};

use super::rewards::{Comparison, RewardArgs};

const TOLERANCE: f64 = 1e-6;
const STEPS: usize = 500;
const RANDOM_GOALS: usize = 3;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    rewards: RewardArgs,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let mismatches = reward_check(args.rewards.env_id, args.seed)?;
    let checks = STEPS * (1 + RANDOM_GOALS);
    let counts = [("reward-check/checks", checks), ("reward-check/mismatches", mismatches)];
    args.rewards.write_counts(args.seed, counts)?;
    Ok(mismatches == 0)
}

/// Runs the check, prints its line and returns the number of mismatches.
pub(crate) fn reward_check(id: EnvId, seed: u64) -> anyhow::Result<usize> {
    let comparison =
        Comparison { steps: STEPS, goals_per_step: RANDOM_GOALS, tolerance: TOLERANCE };
    let found = comparison.run(&mut make(id)?, seed)?;
    let mismatches = found.steps + found.goals;
    let settings = format!("atol={TOLERANCE:e}, n_steps={STEPS}, n_random_goals={RANDOM_GOALS}");
    if mismatches > 0 {
        say!("FAIL: reward checks of {id}: {mismatches} mismatches ({settings})")?;
    } else {
        say!("OK: reward checks passed ({settings})")?;
    }
    Ok(mismatches)
}
