//! `reward-check`: checks that step, compute_reward and the formula agree, also for relabeled
//! goals.

use commands::Command;
use fetch_env::{EnvId, make};
use lexopt::Parser;

use crate::choice::{Flags, usage};
use crate::rewards::Comparison;

const TOLERANCE: f64 = 1e-6;
const STEPS: usize = 500;
const RANDOM_GOALS: usize = 3;

pub(crate) const COMMAND: Command = Command { name: "reward-check", usage: usage!(0), run };

fn run(arguments: Parser) -> anyhow::Result<bool> {
    let flags = Flags::parse(arguments, 0)?;
    let mismatches = reward_check(flags.id, flags.seed)?;
    let checks = STEPS * (1 + RANDOM_GOALS);
    flags
        .write_counts([("reward-check/checks", checks), ("reward-check/mismatches", mismatches)])?;
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
