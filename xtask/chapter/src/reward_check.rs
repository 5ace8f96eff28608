//! `reward-check`: checks that step, compute_reward and the formula agree, also for relabeled
//! goals.

use std::path::PathBuf;

use commands::Command;
use fetch_env::{EnvId, make};
use lexopt::{Arg::Long, Parser, ValueExt};
use serde_json::json;

use crate::{
    choice::{DENSE_REACH, parse_env_id},
    json::{Metric, write_results},
    rewards::Comparison,
};

const TOLERANCE: f64 = 1e-6;
const STEPS: usize = 500;
const RANDOM_GOALS: usize = 3;

pub(crate) const COMMAND: Command = Command {
    name: "reward-check",
    about: "Check that step, compute_reward and the distance formula agree",
    usage: "[--env-id <ID>] [--seed <N>] [--json <FILE>]

  --env-id <ID>  Environment, or auto for FetchReachDense-v4 [default: auto]
  --seed <N>     Seed of resets, actions and goals [default: 0]
  --json <FILE>  Also write the figures as JSON",
    run,
};

fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut id, mut seed, mut json) = (DENSE_REACH, 0, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("env-id") => id = arguments.value()?.parse_with(parse_env_id)?,
            Long("seed") => seed = arguments.value()?.parse()?,
            Long("json") => json = Some(PathBuf::from(arguments.value()?)),
            other => return Err(other.unexpected().into()),
        }
    }
    let mismatches = reward_check(id, seed)?;
    let count = |name: &str, value| (format!("reward-check/{name}"), Metric::count(value));
    let checks = STEPS * (1 + RANDOM_GOALS);
    let results = [count("checks", checks), count("mismatches", mismatches)];
    write_results(json.as_ref(), json!({"env_id": id, "seed": seed}), results)?;
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
