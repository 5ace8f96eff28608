//! `reward-check`: checks that step, compute_reward and the formula agree, also for relabeled goals.

use std::path::PathBuf;

use fetch_env::{EnvId, make_with_config};
use serde_json::json;

use crate::shared::{
    choice::EnvArgs,
    json::{Metric, write_results},
    rewards::Comparison,
};

const TOLERANCE: f64 = 1e-6;
const STEPS: usize = 500;
const RANDOM_GOALS: usize = 3;

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (id, seed) = (args.env.env_id, args.env.seed);
    let mismatches = reward_check(id, seed)?;
    let count = |name: &str, value| (format!("reward-check/{name}"), Metric::count(value));
    let checks = STEPS * (1 + RANDOM_GOALS);
    let results = [count("checks", checks), count("mismatches", mismatches)];
    write_results(args.json.as_ref(), json!({"env_id": id, "seed": seed}), results)?;
    Ok(mismatches == 0)
}

/// Runs the check, prints its line and returns the number of mismatches.
pub fn reward_check(id: EnvId, seed: u64) -> anyhow::Result<usize> {
    let comparison =
        Comparison { steps: STEPS, goals_per_step: RANDOM_GOALS, tolerance: TOLERANCE };
    let found = comparison.run(&mut make_with_config(id.config())?, seed)?;
    let mismatches = found.steps + found.goals;
    let settings = format!("atol={TOLERANCE:e}, n_steps={STEPS}, n_random_goals={RANDOM_GOALS}");
    if mismatches > 0 {
        say!("FAIL: reward checks of {id}: {mismatches} mismatches ({settings})")?;
    } else {
        say!("OK: reward checks passed ({settings})")?;
    }
    Ok(mismatches)
}
