//! `bridge`: the bridging proof of section 2.8.

use std::path::PathBuf;

use commands::Command;
use fetch_env::make;
use lexopt::{Arg::Long, Parser, ValueExt};
use serde_json::json;

use crate::{
    choice::{DENSE_REACH, parse_env_id},
    json::{Metric, write_results},
    rewards::Comparison,
};

const STEPS: usize = 100;
const GOALS_PER_STEP: usize = 5;
const TOLERANCE: f64 = 1e-10;

pub(crate) const COMMAND: Command = Command {
    name: "bridge",
    about: "Compare hand-computed rewards with the environment's, step by step",
    usage: "[--env-id <ID>] [--seed <N>] [--json <FILE>]

  --env-id <ID>  Environment, or auto for FetchReachDense-v4 [default: auto]
  --seed <N>     Seed of resets, actions and goals [default: 42]
  --json <FILE>  Also write the figures as JSON",
    run,
};

fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut id, mut seed, mut json) = (DENSE_REACH, 42, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("env-id") => id = arguments.value()?.parse_with(parse_env_id)?,
            Long("seed") => seed = arguments.value()?.parse()?,
            Long("json") => json = Some(PathBuf::from(arguments.value()?)),
            other => return Err(other.unexpected().into()),
        }
    }
    say!("Environment Anatomy -- Bridging Proof")?;
    say!("=====================================")?;
    say!("Env: {id}, seed={seed}, steps={STEPS}")?;
    say!("Relabeled goals per step: {GOALS_PER_STEP}")?;
    say!("Tolerance: atol={TOLERANCE:e}\n")?;

    let comparison =
        Comparison { steps: STEPS, goals_per_step: GOALS_PER_STEP, tolerance: TOLERANCE };
    let mismatches = comparison.run(&mut make(id)?, seed)?;
    let relabeled = STEPS * GOALS_PER_STEP;
    let count = |name: &str, value| (format!("bridge/{name}"), Metric::count(value));
    let results = [
        count("step-checks", STEPS),
        count("step-mismatches", mismatches.steps),
        count("relabel-checks", relabeled),
        count("relabel-mismatches", mismatches.goals),
    ];
    write_results(json.as_ref(), json!({"env_id": id, "seed": seed}), results)?;
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
