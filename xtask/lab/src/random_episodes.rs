//! `random-episodes`: runs the random baseline of section 2.9.

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use baselines::{Evaluation, RandomPolicy, Summary, evaluate};
use fetch_env::{EnvId, make_with_config};
use serde::Serialize;

use crate::shared::{
    choice::EnvArgs,
    json::{Versions, write_json},
    progress,
};

#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    env: EnvArgs,
    /// Number of episodes
    #[arg(long, default_value = "10")]
    episodes: NonZeroUsize,
    /// Where to write the metrics
    #[arg(long, default_value = "results/ch01_random_metrics.json")]
    random_out: PathBuf,
}

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
    random_episodes(args.env.env_id, args.env.seed, args.episodes.get(), &args.random_out)
}

pub fn random_episodes(id: EnvId, seed: u64, count: usize, out: &Path) -> anyhow::Result<bool> {
    let evaluation = evaluate_random(id, seed, count)?;
    let summary = evaluation.summary()?;
    let metrics = Metrics {
        env_id: id,
        seed,
        n_episodes: count,
        success_rate: summary.success_rate.value,
        return_mean: summary.return_mean.value,
        ep_len_mean: summary.ep_len_mean.value,
        final_distance_mean: summary.final_distance_mean.value,
        confidence_95: summary,
        versions: Versions::current(),
    };
    write_json(out, &metrics)?;
    say!("random-episodes ({count}): {id}; wrote {}", out.display())?;
    for (name, estimate) in [
        ("success_rate", summary.success_rate),
        ("return_mean", summary.return_mean),
        ("ep_len_mean", summary.ep_len_mean),
        ("final_distance_mean", summary.final_distance_mean),
    ] {
        let baselines::Estimate { value, low, high } = estimate;
        say!("  {name:<20} {value:9.4}  (95 % interval {low:.4} to {high:.4})")?;
    }
    Ok(true)
}

pub fn evaluate_random(id: EnvId, seed: u64, count: usize) -> anyhow::Result<Evaluation> {
    let bar = progress::bar(count, "random episodes");
    let mut policy = RandomPolicy::new(seed);
    let evaluation =
        evaluate(&mut make_with_config(id.config())?, &mut policy, count, seed, |_| bar.inc(1))?;
    bar.finish_and_clear();
    Ok(evaluation)
}
