//! `random-episodes`: runs the random baseline of section 2.9.

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use baselines::{Evaluation, RandomPolicy, Summary, evaluate};
use fetch_env::{Env, EnvId, make};
use serde::Serialize;

use crate::shared::{
    env_id::StartArgs,
    json::{Versions, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    start: StartArgs,
    /// Number of episodes
    #[arg(long, default_value = "10")]
    episodes: NonZeroUsize,
    /// Where to write the metrics
    #[arg(long, value_name = "FILE", default_value = OUT)]
    random_out: PathBuf,
}

/// Where the metrics go unless a flag says otherwise.
pub(crate) const OUT: &str = "results/ch01_random_metrics.json";

/// The chapter's number of episodes.
pub(crate) const EPISODES: usize = 10;

/// The contents of the file: figures under the chapter's names, and their intervals.
#[derive(Serialize)]
struct Metrics {
    env_id: EnvId,
    seed: u64,
    n_episodes: usize,
    success_rate: f64,
    return_mean: f64,
    ep_len_mean: f64,
    final_distance_mean: f64,
    confidence_95: Summary,
    versions: Versions,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    random_episodes(args.start, args.episodes.get(), &args.random_out)
}

pub(crate) fn random_episodes(start: StartArgs, count: usize, out: &Path) -> anyhow::Result<bool> {
    let StartArgs { env_id: id, seed } = start;
    let evaluation = evaluate_random(id, seed, count)?;
    let summary = evaluation.summary()?;
    let metrics = Metrics {
        env_id: id,
        seed,
        n_episodes: count,
        success_rate: summary.success_rate.value,
        return_mean: summary.episode_return_mean.value,
        ep_len_mean: summary.episode_length_mean.value,
        final_distance_mean: summary.final_distance_mean.value,
        confidence_95: summary,
        versions: Versions::current(),
    };
    write_json(out, &metrics)?;
    say!("random-episodes ({count}): {id}; wrote {}", out.display())?;
    for (name, estimate) in [
        ("success_rate", summary.success_rate),
        ("return_mean", summary.episode_return_mean),
        ("ep_len_mean", summary.episode_length_mean),
        ("final_distance_mean", summary.final_distance_mean),
    ] {
        let baselines::Estimate { value, low, high } = estimate;
        say!("  {name:<20} {value:9.4}  (95 % interval {low:.4} to {high:.4})")?;
    }
    Ok(true)
}

pub(crate) fn evaluate_random(id: EnvId, seed: u64, count: usize) -> anyhow::Result<Evaluation> {
    let mut env = make(id)?;
    let mut policy = RandomPolicy::new(env.action_space(), seed);
    Ok(evaluate(&mut env, &mut policy, count, seed, |_| ())?)
}
