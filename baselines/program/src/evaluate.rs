//! `evaluate`: runs a policy over many seeded episodes, and prints its figures with their 95 %
//! intervals.

use std::{num::NonZeroUsize, path::PathBuf, thread::available_parallelism};

use anyhow::ensure;
use baselines::{Episode, Estimate, Evaluation, RandomPolicy, Summary, evaluate};
use fetch_env::{Env, EnvId, FetchConfig, make};
use indicatif::ProgressBar;
use rayon::{ThreadPool, ThreadPoolBuilder, prelude::*};
use serde::Serialize;

use crate::shared::{
    choice::{ModelChoice, acting, policy_of},
    json::{Metric, write_results},
    progress,
};

/// The most threads of a command, as of a vector of environments.
const MAX_THREADS: usize = 1024;

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environments, separated by commas
    #[arg(long, value_name = "ID", value_delimiter = ',', default_value = "FetchReach-v4")]
    env_id: Vec<EnvId>,
    /// Policy that acts: random, scripted, trained, zero, or the file of a trained one
    #[arg(long, default_value = "trained")]
    policy: String,
    /// Number of episodes in each environment
    #[arg(long, default_value = "100")]
    episodes: NonZeroUsize,
    /// Seed of the first episode; the others have the seeds that follow
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Number of threads; results do not depend on it
    #[arg(long)]
    #[arg(default_value_t = available_parallelism().unwrap_or(NonZeroUsize::MIN))]
    #[serde(skip)]
    threads: NonZeroUsize,
    /// Model of the robot
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Also write the figures as JSON
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    json: Option<PathBuf>,
}

/// A figure: its name in JSON, its column in the table, its decimals, and its unit.
struct Figure {
    name: &'static str,
    column: &'static str,
    decimals: usize,
    unit: &'static str,
    of: fn(&Summary) -> Estimate,
}

const FIGURES: [Figure; 5] = [
    Figure {
        name: "success_rate",
        column: "success at the end",
        decimals: 3,
        unit: "1",
        of: |summary| summary.success_rate,
    },
    Figure {
        name: "success_any_rate",
        column: "success at any time",
        decimals: 3,
        unit: "1",
        of: |summary| summary.success_any_rate,
    },
    Figure {
        name: "episode_return_mean",
        column: "return",
        decimals: 2,
        unit: "1",
        of: |summary| summary.episode_return_mean,
    },
    Figure {
        name: "episode_length_mean",
        column: "length",
        decimals: 1,
        unit: "1",
        of: |summary| summary.episode_length_mean,
    },
    Figure {
        name: "final_distance_mean",
        column: "final distance (m)",
        decimals: 4,
        unit: "m",
        of: |summary| summary.final_distance_mean,
    },
];

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let threads = args.threads.min(args.episodes).get();
    ensure!(threads <= MAX_THREADS, "{threads} threads are too many: use at most {MAX_THREADS}");
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    let total = args.episodes.get().saturating_mul(args.env_id.len());
    let bar = progress::bar(total, "episodes");
    let mut rows = Vec::new();
    for &env_id in &args.env_id {
        let task = Evaluating {
            config: env_id.config().with_model(args.model.source()),
            policy: &args.policy,
            episodes: args.episodes.get(),
            seed: args.seed,
        };
        let evaluation = task.on_all(&pool, &bar)?;
        rows.push((env_id, evaluation.summary()?));
    }
    bar.finish_and_clear();
    print(args, &rows)?;
    let figures = rows.iter().flat_map(|(env_id, summary)| figures(*env_id, summary));
    write_results(args.json.as_ref(), args, figures)?;
    Ok(true)
}

/// An evaluation of a policy in one kind of environment.
pub struct Evaluating<'a> {
    pub config: FetchConfig,
    pub policy: &'a str,
    pub episodes: usize,
    pub seed: u64,
}

impl Evaluating<'_> {
    /// Runs the episodes on all threads of the pool, each with its own environment and policy.
    pub fn on_all(&self, pool: &ThreadPool, bar: &ProgressBar) -> anyhow::Result<Evaluation> {
        let seeds: Vec<u64> =
            (0..self.episodes as u64).map(|episode| self.seed.wrapping_add(episode)).collect();
        let threads = pool.current_num_threads();
        let parts: Vec<Vec<Episode>> = pool.install(|| {
            let parts = seeds.par_chunks(seeds.len().div_ceil(threads));
            parts.map(|seeds| self.on_one(seeds, bar)).collect::<anyhow::Result<_>>()
        })?;
        Ok(Evaluation { episodes: parts.concat() })
    }

    /// Runs an episode for each seed.
    fn on_one(&self, seeds: &[u64], bar: &ProgressBar) -> anyhow::Result<Vec<Episode>> {
        let mut env = make(self.config.clone())?;
        let mut policy = policy_of(self.policy, &env, self.seed)?;
        let mut episodes = Vec::new();
        for &seed in seeds {
            let mut random = RandomPolicy::new(env.action_space(), seed);
            let policy = acting(self.policy, &mut random, &mut *policy);
            episodes.extend(evaluate(&mut env, policy, 1, seed, |_| bar.inc(1))?.episodes);
        }
        Ok(episodes)
    }
}

/// Prints a row for each environment: each figure with its 95 % interval.
fn print(args: &Args, rows: &[(EnvId, Summary)]) -> anyhow::Result<()> {
    let columns = FIGURES.map(|figure| figure.column).join(" | ");
    say!("evaluate: {}, {} episodes; 95 % intervals", args.policy, args.episodes)?;
    say!("| environment | {columns} |\n|---|{}", "---|".repeat(FIGURES.len()))?;
    for (env_id, summary) in rows {
        let cells = FIGURES.map(|Figure { decimals, of, .. }| {
            let Estimate { value, low, high } = of(summary);
            format!("{value:.decimals$} ({low:.decimals$} to {high:.decimals$})")
        });
        say!("| {env_id} | {} |", cells.join(" | "))?;
    }
    Ok(())
}

/// Returns each figure and the ends of its interval, which a single episode does not have.
fn figures(env_id: EnvId, summary: &Summary) -> Vec<(String, Metric)> {
    let mut figures = Vec::new();
    for Figure { name, unit, of, .. } in FIGURES {
        let Estimate { value, low, high } = of(summary);
        let name = format!("evaluate/{env_id}/{name}");
        let ends = [(format!("{name}/low"), low), (format!("{name}/high"), high)];
        figures.push((name, Metric::new(value, unit)));
        let ends = ends.into_iter().filter(|(_, end)| end.is_finite());
        figures.extend(ends.map(|(name, end)| (name, Metric::new(end, unit))));
    }
    figures
}
