//! `random-episodes`: runs the random baseline of section 2.9.

use std::{
    num::NonZeroUsize,
    path::{Path, PathBuf},
};

use baselines::{Evaluation, RandomPolicy, Summary, evaluate};
use commands::Command;
use fetch_env::{Env, EnvId, make};
use lexopt::{Arg::Long, Parser, ValueExt};
use serde::Serialize;

use crate::{
    choice::{DENSE_REACH, parse_env_id},
    json::{Versions, write_json},
};

pub(crate) const COMMAND: Command = Command {
    name: "random-episodes",
    usage: "[--env-id <ID>] [--seed <N>] [--episodes <N>] [--random-out <FILE>]

  --env-id <ID>        Environment, or auto for FetchReachDense-v4 [default: auto]
  --seed <N>           Seed of resets, actions and goals [default: 0]
  --episodes <N>       Number of episodes [default: 10]
  --random-out <FILE>  Where to write the metrics
                       [default: results/ch01_random_metrics.json]",
    run,
};

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

fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut id, mut seed, mut count, mut out) = (DENSE_REACH, 0, EPISODES, PathBuf::from(OUT));
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("env-id") => id = arguments.value()?.parse_with(parse_env_id)?,
            Long("seed") => seed = arguments.value()?.parse()?,
            Long("episodes") => count = arguments.value()?.parse::<NonZeroUsize>()?.get(),
            Long("random-out") => out = arguments.value()?.into(),
            other => return Err(other.unexpected().into()),
        }
    }
    random_episodes(id, seed, count, &out)
}

pub(crate) fn random_episodes(
    id: EnvId,
    seed: u64,
    count: usize,
    out: &Path,
) -> anyhow::Result<bool> {
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
