//! `datasets`: writes data sets of the eight environments, in the formats of other projects. Ctrl-C
//! and SIGTERM end it after the current episodes and remove the unfinished sets, a second signal ends
//! it at once.

pub mod format;
mod set;

use std::{fs, num::NonZeroUsize, path::PathBuf};

use fetch_env::EnvId;
use rayon::prelude::*;
use serde_json::json;

use self::format::Format;
use self::set::{Kind, Set, Written};
use crate::output::usage;
use crate::shared::{
    choice::{ModelChoice, flag_name},
    json::{Metric, write_results},
    progress,
    signals::{Signals, Stopped},
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Folder for the data sets: those for Minari go to its folder `minari` (set
    /// MINARI_DATASETS_PATH to it), and those for OGBench to `ogbench`
    #[arg(long)]
    out: PathBuf,
    /// Only these, separated by commas: an environment (FetchPush-v4), a set (random, scripted,
    /// expert, expert-noisy, mixed, replay), or one set of one environment (FetchPush-v4/expert)
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Steps of each set; the last episode may add some
    #[arg(long, default_value = "1000000")]
    steps: NonZeroUsize,
    /// Formats, separated by commas; all by default
    #[arg(long, value_enum, value_delimiter = ',')]
    format: Vec<Format>,
    /// Seed of the first episode of each set; the others have the seeds that follow. For replay,
    /// the seed of the run
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Also write the exact state of each step, only in Minari's format: about 3 kB per step
    #[arg(long)]
    snapshots: bool,
    /// Also write the table as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    if args.snapshots && args.format != [Format::Minari] {
        return Err(usage("--snapshots: only Minari's format has them, so add --format minari"));
    }
    let formats = if args.format.is_empty() { &Format::ALL[..] } else { &args.format };
    let mut sets = Vec::new();
    for (env_id, kind) in chosen(&args.only)? {
        let steps = env_id.config().max_episode_steps().get() as usize;
        let episodes = args.steps.get().div_ceil(steps);
        if episodes < 2 && formats.contains(&Format::Ogbench) {
            let least = steps + 1;
            return Err(usage(format_args!(
                "--steps: OGBench's format needs two episodes, so choose at least {least}, or \
                 another --format"
            )));
        }
        let first_seed = args.seed;
        let Args { model, snapshots, .. } = *args;
        sets.push(Set { env_id, kind, model, episodes, first_seed, snapshots });
    }
    // Several sets share the folders: none of them knows when the last one leaves them empty.
    let folders = formats.iter().map(|format| format.root(&args.out)).collect::<Vec<_>>();
    let folders = folders.iter().map(PathBuf::as_path).chain(args.out.ancestors());
    let new: Vec<_> = folders.filter(|folder| !folder.exists()).collect();
    let signals = Signals::listen()?;
    let put_off = signals.put_off();
    let bar = progress::bar(sets.len().saturating_mul(args.steps.get()), "steps");
    let write =
        |set: &Set| set.write(tasks, &args.out, formats, &command(args, set), &bar, &signals);
    // One thread writes a set, so the number of threads changes no bit.
    let written = sets.par_iter().map(write).collect::<anyhow::Result<Vec<_>>>();
    bar.finish_and_clear();
    drop(put_off);
    if written.is_err() {
        new.iter().for_each(|folder| drop(fs::remove_dir(folder)));
    }
    if let Some(stopped) = Stopped::by(signals.received()) {
        crate::output::tell(format_args!("datasets: {stopped}: removed the unfinished sets"));
        return Err(stopped.into());
    }
    report(args, &written?)?;
    Ok(true)
}

/// Returns the sets that `--only` names, or all without it.
fn chosen(only: &[String]) -> anyhow::Result<Vec<(EnvId, Kind)>> {
    let all = EnvId::ALL.into_iter().flat_map(|id| Kind::all().map(move |kind| (id, kind)));
    let names = |(id, kind): (EnvId, Kind)| {
        let kind = kind.name();
        [id.to_string(), kind.to_owned(), format!("{id}/{kind}")]
    };
    for name in only {
        if !all.clone().any(|set| names(set).contains(name)) {
            return Err(usage(format_args!(
                "--only {name}: name an environment (FetchPush-v4), a set (random, scripted, \
                 expert, expert-noisy, mixed, replay), or both (FetchPush-v4/expert)"
            )));
        }
    }
    let is_chosen = |set: &_| only.is_empty() || names(*set).iter().any(|name| only.contains(name));
    Ok(all.filter(is_chosen).collect())
}

/// Returns the command that reproduces a set.
fn command(args: &Args, set: &Set) -> String {
    let Args { steps, seed, model, snapshots, .. } = args;
    let (id, kind, model) = (set.env_id, set.kind.name(), flag_name(*model));
    let snapshots = if *snapshots { " --format minari --snapshots" } else { "" };
    format!(
        "fetch-env datasets --out DIR --only {id}/{kind} --steps {steps} --seed {seed} --model {model}\
         {snapshots}"
    )
}

/// Prints the table of the sets.
fn report(args: &Args, written: &[Written]) -> anyhow::Result<()> {
    let mut figures = Vec::new();
    say!("| set | format | steps | MB | SHA-256 | success rate | return |")?;
    say!("|---|---|---|---|---|---|---|")?;
    for Written { set, steps, evaluation, contents } in written {
        let summary = evaluation.summary()?;
        let (success, mean) = (summary.success_rate.value, summary.episode_return_mean.value);
        let (id, kind) = (set.env_id, set.kind.name());
        let figure = |name: &str| format!("datasets/{id}/{kind}/{name}");
        figures.extend([
            (figure("steps"), Metric::count(*steps)),
            (figure("success_rate"), Metric::new(success, "1")),
            (figure("episode_return_mean"), Metric::new(mean, "1")),
        ]);
        for (format, contents) in contents {
            let format = flag_name(*format);
            let megabytes = contents.bytes as f64 / 1e6;
            say!(
                "| {id}/{kind} | {format} | {steps} | {megabytes:.1} | {} | {success:.3} | \
                 {mean:.2} |",
                contents.checksum
            )?;
            figures.push((figure(&format!("{format}/size")), Metric::new(megabytes, "MB")));
        }
    }
    let Args { steps, seed, model, .. } = args;
    write_results(
        args.json.as_ref(),
        json!({ "steps": steps, "seed": seed, "model": model }),
        figures,
    )
}
