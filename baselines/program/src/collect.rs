//! `collect`: runs a policy and saves its episodes, as data for learning without an environment.
//! Ctrl-C and SIGTERM end it without a file or a data set.

use std::{
    ffi::OsStr,
    io::Cursor,
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use anyhow::Context;
use baselines::{
    Estimate, Evaluation, OnMujoco, RandomPolicy, buffer_config, collect,
    datasets::EpisodeRecord,
    gather_episodes,
    workers::{Workers, share},
};
use fetch_env::{Env, EnvId};
use her_relabel::HerBuffer;
use serde_json::json;

use crate::datasets::format::Format;
use crate::output::usage;
use crate::shared::{
    choice::{ModelChoice, acting, flag_name, policy_of},
    json::{Metric, write_results},
    progress,
    ranks::{RankArgs, share_run},
    signals::{Signals, Stopped},
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// Environment
    #[arg(long, default_value = "FetchReach-v4")]
    env_id: EnvId,
    /// Policy that acts: random, proportional (or proportional=GAIN), scripted, trained, robust,
    /// zero, or the file of a trained one
    #[arg(long, default_value = "random")]
    policy: String,
    /// Number of episodes
    #[arg(long, default_value = "100")]
    episodes: NonZeroUsize,
    /// Seed of the first episode; the others have the seeds that follow
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Where to save the episodes: an archive of numpy arrays (.npz), or a replay buffer (any other
    /// name)
    #[arg(long)]
    out: Option<PathBuf>,
    /// Write a data set instead, named `fetch/TASK/POLICY-v0`, into the folder that --out names
    #[arg(long, value_enum, requires = "out", conflicts_with = "mpi")]
    format: Option<Format>,
    /// Also write the exact state of each step, only in Minari's format: about 3 kB per step
    #[arg(long, requires = "format")]
    snapshots: bool,
    /// Also write the results as JSON
    #[arg(long)]
    json: Option<PathBuf>,
    #[command(flatten)]
    ranks: RankArgs,
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    let facts = [
        ("command", "collect".to_owned()),
        ("--env-id", args.env_id.to_string()),
        ("--policy", args.policy.clone()),
        ("--episodes", args.episodes.to_string()),
        ("--seed", args.seed.to_string()),
        ("--model", flag_name(args.model)),
    ];
    if let (Some(format), Some(out)) = (args.format, &args.out) {
        return collect_dataset(tasks, args, format, out);
    }
    share_run(&args.ranks, &facts, |workers| collect_shared(tasks, args, &mut *workers()))
}

/// Collects this rank's share of the episodes; the first rank saves those of all ranks.
fn collect_shared(
    tasks: &impl Tasks,
    args: &Args,
    workers: &mut dyn Workers,
) -> anyhow::Result<bool> {
    let config = args.env_id.config().with_model(args.model.source());
    let mut env = tasks.make(config)?;
    let own = share(workers, args.episodes.get());
    let steps = env.config().max_episode_steps().get() as usize;
    let config = buffer_config(args.episodes.get().saturating_mul(steps), &env)?;
    let mut buffer = HerBuffer::<f64>::new(config.clone())?;
    let mut policy = policy_of(&args.policy, &env, args.seed)?;
    let bar = progress::bar(own.len(), "episodes");
    let mut evaluation = Evaluation { episodes: Vec::new() };
    for episode in own {
        let seed = args.seed.wrapping_add(episode as u64);
        let mut random = RandomPolicy::new(env.action_space(), seed);
        let policy = acting(&args.policy, &mut random, &mut *policy);
        let one = collect(&mut env, policy, 1, seed, &mut buffer, 0, |_| bar.inc(1))?;
        evaluation.episodes.extend(one.episodes);
    }
    bar.finish_and_clear();
    let evaluation = gather_episodes(workers, &evaluation)?;
    let mut archive = Cursor::new(Vec::new());
    buffer.write_npz(&mut archive)?;
    let archives = workers.gather_first(archive.into_inner());
    if workers.rank() > 0 {
        return Ok(true);
    }
    let mut buffer = HerBuffer::<f64>::new(config)?;
    for archive in archives {
        buffer.import_npz_bytes(&archive)?;
    }
    if let Some(out) = &args.out {
        let is_archive = out.extension().is_some_and(|extension| extension == "npz");
        let saved = if is_archive { buffer.export_npz(out) } else { buffer.save(out) };
        saved.with_context(|| format!("cannot write {}", out.display()))?;
    }
    report(args, &evaluation)
}

/// Writes the episodes as a data set, one after another.
fn collect_dataset(
    tasks: &impl Tasks,
    args: &Args,
    format: Format,
    out: &Path,
) -> anyhow::Result<bool> {
    let Args { env_id, policy: name, episodes, seed, model, snapshots, .. } = args;
    if *snapshots && format != Format::Minari {
        return Err(usage("--snapshots: only Minari's format has them, so use --format minari"));
    }
    let mut env = tasks.make(env_id.config().with_model(model.source()))?;
    let mut policy = policy_of(name, &env, *seed)?;
    let stem = Path::new(name).file_stem().and_then(OsStr::to_str).unwrap_or_default();
    let command = format!(
        "cargo xtask collect --env-id {env_id} --policy {name} --episodes {episodes} --seed {seed} \
         --model {} --format {}{} --out DIR",
        flag_name(*model),
        flag_name(format),
        if *snapshots { " --snapshots" } else { "" }
    );
    let metadata = tasks.metadata(&tasks.set_name(*env_id, stem), &env, name, &command)?;
    let signals = Signals::listen()?;
    let put_off = signals.put_off();
    let mut writer = format.create(out, metadata, *snapshots)?;
    let bar = progress::bar(episodes.get(), "episodes");
    let mut record = EpisodeRecord::default();
    if *snapshots {
        record = record.with_snapshots();
    }
    let mut evaluation = Evaluation { episodes: Vec::new() };
    for seed in (0..episodes.get() as u64).map(|episode| seed.wrapping_add(episode)) {
        if let Some(stopped) = Stopped::by(signals.received()) {
            crate::output::tell(format_args!(
                "collect: {stopped}: removed the unfinished data set"
            ));
            return Err(stopped.into());
        }
        let mut random = RandomPolicy::new(env.action_space(), seed);
        let policy = acting(name, &mut random, &mut *policy);
        evaluation.episodes.push(record.record(&mut env, policy, seed)?);
        writer.write(&record)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    writer.finish()?;
    drop(put_off);
    report(args, &evaluation)
}

fn report(args: &Args, evaluation: &Evaluation) -> anyhow::Result<bool> {
    let Args { env_id, policy, out, .. } = args;
    let episodes = evaluation.episodes.len();
    let transitions = evaluation.episodes.iter().map(|episode| episode.episode_length).sum();
    let summary = evaluation.summary()?;
    let Estimate { value, low, high } = summary.success_rate;
    let name = |figure: &str| format!("collect/{env_id}/{figure}");
    let figures = [
        (name("episodes"), Metric::count(episodes)),
        (name("transitions"), Metric::count(transitions)),
        (name("success_rate"), Metric::new(value, "1")),
        (name("episode_return_mean"), Metric::new(summary.episode_return_mean.value, "1")),
    ];
    let settings = json!({
        "env_id": env_id,
        "policy": policy,
        "episodes": args.episodes,
        "seed": args.seed,
        "model": args.model,
    });
    write_results(args.json.as_ref(), settings, figures)?;
    let saved = out.as_ref().map_or_else(String::new, |out| format!("; wrote {}", out.display()));
    say!(
        "collect: {env_id}, {policy}: {episodes} episodes, success rate {value:.2} ({low:.2} to \
         {high:.2}){saved}"
    )?;
    Ok(true)
}
