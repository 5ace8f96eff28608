//! `verify`: the chapter's lab, every check by stepping the environments.

mod actions;
mod baseline;
mod conformance;
pub mod goals;
mod observations;
mod relabelling;
mod rewards;
mod tasks;

use std::path::PathBuf;

use fetch_env::{EnvId, MujocoEnv, make_config};
use serde::Serialize;

use crate::{
    check::{self, Check},
    progress,
    report::{Report, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    /// Only this environment
    #[arg(long)]
    env_id: Option<EnvId>,
    /// Seed of resets, actions and goals
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Settings {
    env_ids: Vec<EnvId>,
    seed: u64,
}

/// A part of the lab: the sections of the chapter and the checks of one environment.
type Part = fn(EnvId, &mut MujocoEnv, u64) -> anyhow::Result<Vec<Check>>;

const PARTS: [Part; 6] = [
    observations::check,
    actions::check,
    rewards::check,
    relabelling::check,
    conformance::check,
    baseline::check,
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let ids = args.env_id.map_or_else(|| EnvId::ALL.to_vec(), |id| vec![id]);
    let mut all = Vec::new();
    let mut passed = true;
    let bar = progress::bar(ids.len() * PARTS.len() + 1, "verify");
    for &id in &ids {
        let mut env = make_config(id.config())?;
        let mut checks = Vec::new();
        for part in PARTS {
            checks.extend(part(id, &mut env, args.seed)?);
            bar.inc(1);
        }
        passed &= bar.suspend(|| check::print(&id.to_string(), &checks));
        all.extend(checks.into_iter().map(|check| (id.to_string(), check)));
    }
    if args.env_id.is_none() {
        let checks = tasks::check(args.seed)?;
        passed &= bar.suspend(|| check::print("All tasks", &checks));
        all.extend(checks.into_iter().map(|check| ("all".into(), check)));
    }
    bar.finish_and_clear();

    let failed = all.iter().filter(|(_, check)| !check.passed).count();
    println!("\n{} checks, {failed} failed", all.len());
    if let Some(path) = &args.json {
        let settings = Settings { env_ids: ids, seed: args.seed };
        let results = all
            .into_iter()
            .map(|(id, check)| (format!("verify/{id}/{}", check.name), check.figure));
        write_json(path, &Report::new(settings, results))?;
    }
    Ok(passed)
}
