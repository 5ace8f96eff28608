//! `verify`: the chapter's lab, every check by stepping the environments.

mod actions;
mod baseline;
mod conformance;
pub mod goals;
mod observations;
mod relabelling;
mod rewards;
mod tasks;

use std::{
    path::PathBuf,
    sync::atomic::{AtomicUsize, Ordering},
};

use anyhow::anyhow;
use fetch_env::{EnvId, MujocoEnv, make_config};
use indicatif::ProgressBar;
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
    let bar = progress::bar(ids.len() * PARTS.len(), "verify");
    let mut all = check_all(&ids, args.seed, &bar)?;
    if args.env_id.is_none() {
        all.push(("All tasks".into(), tasks::check(args.seed)?));
    }
    bar.finish_and_clear();

    for (heading, checks) in &all {
        check::print(heading, checks);
    }
    let count = all.iter().map(|(_, checks)| checks.len()).sum::<usize>();
    let failed = all.iter().flat_map(|(_, checks)| checks).filter(|check| !check.passed).count();
    println!("\n{count} checks, {failed} failed");
    if let Some(path) = &args.json {
        let settings = Settings { env_ids: ids, seed: args.seed };
        let results = all.into_iter().flat_map(|(heading, checks)| {
            let figure = move |check: Check| {
                (format!("verify/{}/{}", heading.replace(' ', "-"), check.name), check.figure)
            };
            checks.into_iter().map(figure)
        });
        write_json(path, &Report::new(settings, results))?;
    }
    Ok(failed == 0)
}

/// The checks of each environment, in the order of `ids`, on all cores.
fn check_all(
    ids: &[EnvId],
    seed: u64,
    bar: &ProgressBar,
) -> anyhow::Result<Vec<(String, Vec<Check>)>> {
    let next = AtomicUsize::new(0);
    let work = || -> anyhow::Result<Vec<(usize, Vec<Check>)>> {
        let mut done = Vec::new();
        while let Some((index, &id)) = {
            let index = next.fetch_add(1, Ordering::Relaxed);
            ids.get(index).map(|id| (index, id))
        } {
            done.push((index, check_one(id, seed, bar)?));
        }
        Ok(done)
    };
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(ids.len());
    let mut done = std::thread::scope(|scope| -> anyhow::Result<Vec<_>> {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        let mut done = Vec::new();
        for worker in workers {
            done.extend(worker.join().map_err(|_| anyhow!("a check panicked"))??);
        }
        Ok(done)
    })?;
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(index, checks)| (ids[index].to_string(), checks)).collect())
}

fn check_one(id: EnvId, seed: u64, bar: &ProgressBar) -> anyhow::Result<Vec<Check>> {
    let mut env = make_config(id.config())?;
    let mut checks = Vec::new();
    for part in PARTS {
        checks.extend(part(id, &mut env, seed)?);
        bar.inc(1);
    }
    progress::note(bar, format_args!("verified {id}"));
    Ok(checks)
}
