//! `bridge`: the bridging proof of section 2.8.

use std::path::PathBuf;

use fetch_env::{EnvId, make_with_config};
use serde_json::json;

use crate::shared::{
    choice::parse_env_id,
    json::{Metric, write_results},
    rewards::Comparison,
};

const STEPS: usize = 100;
const GOALS_PER_STEP: usize = 5;
const TOLERANCE: f64 = 1e-10;

#[derive(clap::Args)]
pub struct Args {
    /// Environment, or auto for FetchReachDense-v4
    #[arg(long, default_value = "auto", value_parser = parse_env_id)]
    env_id: EnvId,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 42)]
    seed: u64,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let id = args.env_id;
    let seed = args.seed;
    say!("Environment Anatomy -- Bridging Proof")?;
    say!("=====================================")?;
    say!("Env: {id}, seed={seed}, steps={STEPS}")?;
    say!("Relabeled goals per step: {GOALS_PER_STEP}")?;
    say!("Tolerance: atol={TOLERANCE:e}\n")?;

    let comparison =
        Comparison { steps: STEPS, goals_per_step: GOALS_PER_STEP, tolerance: TOLERANCE };
    let mismatches = comparison.run(&mut make_with_config(id.config())?, seed)?;
    let relabeled = STEPS * GOALS_PER_STEP;
    let count = |name: &str, value| (format!("bridge/{name}"), Metric::count(value));
    let results = [
        count("step-checks", STEPS),
        count("step-mismatches", mismatches.steps),
        count("relabel-checks", relabeled),
        count("relabel-mismatches", mismatches.goals),
    ];
    write_results(args.json.as_ref(), json!({"env_id": id, "seed": seed}), results)?;
    say!("Step reward checks:    {STEPS} steps, mismatches={}", mismatches.steps)?;
    say!("Relabel reward checks: {relabeled} checks, mismatches={}\n", mismatches.goals)?;
    if mismatches.steps + mismatches.goals > 0 {
        say!("[MISMATCH] Some rewards differ by more than atol={TOLERANCE:e}\n")?;
        say!("[BRIDGE FAILED]")?;
        return Ok(false);
    }
    say!("[MATCH] All rewards match within atol={TOLERANCE:e}")?;
    say!("  manual_reward == compute_reward == step_reward  ({STEPS} steps)")?;
    say!("  relabel_reward == reward(ag, random_goal)  ({relabeled} checks)\n")?;
    say!("[BRIDGE OK] Bridging proof passed")?;
    Ok(true)
}
