//! `evaluate`: runs a policy over many seeded episodes, and prints its figures with their 95 %
//! intervals.

use std::path::PathBuf;

use baselines::{Estimate, Summary};
use fetch_env::EnvId;
use serde::Serialize;

use crate::shared::{
    episodes::EpisodeArgs,
    json::{Metric, write_results},
    progress,
};

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environments, separated by commas
    #[arg(long, value_name = "ID", value_delimiter = ',', default_value = "FetchReach-v4")]
    env_id: Vec<EnvId>,
    /// Policy that acts: random, scripted, trained, zero, or the file of a trained one
    #[arg(long, default_value = "trained")]
    policy: String,
    #[command(flatten)]
    #[serde(flatten)]
    episodes: EpisodeArgs,
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
    let (run, policy) = (&args.episodes, &args.policy);
    let threads = run.threads()?;
    let bar = progress::bar(run.episodes.get().saturating_mul(args.env_id.len()), "episodes");
    let mut rows = Vec::new();
    for &env_id in &args.env_id {
        let evaluation = run.evaluate(&run.config(env_id), policy, &threads, &bar)?;
        rows.push((env_id, evaluation.summary()?));
    }
    bar.finish_and_clear();
    print(args, &rows)?;
    let figures = rows.iter().flat_map(|(env_id, summary)| figures(*env_id, summary));
    write_results(args.json.as_ref(), args, figures)?;
    Ok(true)
}

/// Prints a row for each environment: each figure with its 95 % interval.
fn print(args: &Args, rows: &[(EnvId, Summary)]) -> anyhow::Result<()> {
    let columns = FIGURES.map(|figure| figure.column).join(" | ");
    say!("evaluate: {}, {} episodes; 95 % intervals", args.policy, args.episodes.episodes)?;
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
