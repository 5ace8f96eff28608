//! `verify`: runs every check of the chapter's lab by stepping the environments.

mod actions;
mod baseline;
mod observations;
mod rewards;

use std::path::PathBuf;

use anyhow::Context;
use fetch_env::{
    Env, EnvId, GoalEnv, GoalObservation, MujocoEnv, Task,
    check::{CheckOptions, check_goal_env},
    make,
};
use goal_reward::RewardKind;
use rayon::prelude::*;
use serde_json::json;

use crate::{
    output::tell,
    shared::{
        check::{self, Check},
        json::{Metric, write_results},
    },
};

#[derive(clap::Args)]
pub struct Args {
    /// Check this environment only
    #[arg(long, value_name = "ID")]
    env_id: Option<EnvId>,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

/// A part of the lab: the checks of one environment for one or two sections of the chapter.
type Part = fn(EnvId, &mut MujocoEnv, u64) -> anyhow::Result<Vec<Check>>;

const PARTS: [Part; 5] =
    [observations::check, actions::check, rewards::check, conformance, baseline::check];

/// Checks of one environment, or of what all have in common.
#[derive(Clone, Debug)]
pub struct Group {
    /// The environment's id, or what the checks are about.
    pub heading: String,
    /// The checks.
    pub checks: Vec<Check>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let (ids, seed) = (all_ids(args.env_id), args.seed);
    let groups = check_environments(&ids, seed)?;
    for Group { heading, checks } in &groups {
        check::print(heading, checks)?;
    }
    let count = groups.iter().map(|group| group.checks.len()).sum::<usize>();
    let failed = failed(&groups);
    say!("\n{count} checks, {failed} failed")?;
    let settings = json!({"env_ids": ids, "seed": seed});
    let results = groups.into_iter().flat_map(|Group { heading, checks }| {
        let figure = move |check: Check| {
            (format!("verify/{}/{}", heading.replace(' ', "-"), check.name), check.figure)
        };
        checks.into_iter().map(figure)
    });
    write_results(args.json.as_ref(), settings, results)?;
    Ok(failed == 0)
}

/// Returns the given environment alone, or all.
pub fn all_ids(only: Option<EnvId>) -> Vec<EnvId> {
    only.map_or_else(|| EnvId::ALL.to_vec(), |id| vec![id])
}

/// Returns the number of checks that failed.
pub fn failed(groups: &[Group]) -> usize {
    groups.iter().flat_map(|group| &group.checks).filter(|check| !check.passed).count()
}

/// Runs the checks of each environment on all cores, and returns them in the order of `ids`; then,
/// if these are all environments, the checks of what the tasks have in common. Reports each
/// environment on standard error.
///
/// # Errors
/// An environment cannot be made or stepped.
pub fn check_environments(ids: &[EnvId], seed: u64) -> anyhow::Result<Vec<Group>> {
    let mut groups = ids
        .par_iter()
        .map(|&id| Ok(Group { heading: id.to_string(), checks: check_one(id, seed)? }))
        .collect::<anyhow::Result<Vec<_>>>()?;
    if ids.len() == EnvId::ALL.len() {
        groups.push(Group { heading: "All tasks".into(), checks: interface(seed)? });
    }
    Ok(groups)
}

/// Runs the checks of observations or of rewards, and returns the one with this name.
pub(crate) fn check_by_name(id: EnvId, seed: u64, name: &str) -> anyhow::Result<Check> {
    let mut env = make(id)?;
    let part = if name.starts_with("reward/") { rewards::check } else { observations::check };
    let found = part(id, &mut env, seed)?.into_iter().find(|check| check.name == name);
    found.with_context(|| format!("there is no check {name}"))
}

fn check_one(id: EnvId, seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut env = make(id)?;
    let mut checks = Vec::new();
    for part in PARTS {
        checks.extend(part(id, &mut env, seed)?);
    }
    tell(format_args!("verified {id}"));
    Ok(checks)
}

/// Runs the checks of fetch-env's environment checker.
fn conformance(id: EnvId, _env: &mut MujocoEnv, seed: u64) -> anyhow::Result<Vec<Check>> {
    let options = CheckOptions::default().with_seed(seed);
    let report = check_goal_env(|| Ok(make(id)?), &options);
    Ok(report
        .checks
        .iter()
        .map(|check| {
            let faults = usize::from(!check.passed);
            let name = format!("conformance/{}", check.name);
            Check::new(name, check.passed, &check.message, Metric::count(faults))
        })
        .collect())
}

/// Section 2.7: one interface, four tasks.
fn interface(seed: u64) -> anyhow::Result<Vec<Check>> {
    let mut checks = Vec::new();
    let mut action_lengths = Vec::new();
    let mut thresholds = Vec::new();
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let mut env = make(id)?;
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
