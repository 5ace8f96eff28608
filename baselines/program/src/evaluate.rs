//! `evaluate`: runs a policy over many seeded episodes, and prints its figures with their 95 %
//! intervals.

use std::path::PathBuf;

use baselines::{Estimate, Summary, stratum};
use fetch_env::EnvId;
use serde::Serialize;

use crate::shared::{
    episodes::EpisodeArgs,
    json::{Metric, write_results},
    progress,
    tasks::Tasks,
};

#[derive(Clone, Debug, clap::Args, Serialize)]
pub struct Args {
    /// Environments, separated by commas
    #[arg(long, value_name = "ID", value_delimiter = ',', default_value = "FetchReach-v4")]
    env_id: Vec<EnvId>,
    /// Policy that acts: random, proportional (or proportional=GAIN), scripted, trained, robust,
    /// pixels (sees pictures), zero, or the file of a trained one
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
    of: fn(&Summary) -> Option<Estimate>,
}

macro_rules! figures {
    ($($table:ident {
        $($name:ident $column:literal $decimals:literal $unit:literal $of:expr;)*
    })*) => {$(
        const $table: &[Figure] = &[$(Figure {
            name: stringify!($name),
            column: $column,
            decimals: $decimals,
            unit: $unit,
            of: $of,
        }),*];
    )*};
}

figures! {
    OUTCOME {
    success_rate "success at the end" 3 "1" |s| Some(s.success_rate);
    success_any_rate "success at any time" 3 "1" |s| Some(s.success_any_rate);
    episode_return_mean "return" 2 "1" |s| Some(s.episode_return_mean);
    episode_length_mean "length" 1 "1" |s| Some(s.episode_length_mean);
    final_distance_mean "final distance (m)" 4 "m" |s| Some(s.final_distance_mean);
    }
    CONTROLS {
    steps_to_success_mean "steps to the first success" 1 "1" |s| s.controls?.steps_to_success_mean;
    action_change_mean "squared change of the action" 3 "1" |s| Some(s.controls?.action_change_mean);
    largest_action_mean "largest action" 3 "1" |s| Some(s.controls?.largest_action_mean);
    path_mean "gripper's path (m)" 3 "m" |s| s.controls?.path_mean;
    energy_mean "energy" 2 "1" |s| Some(s.controls?.energy_mean);
    }
}

/// The figures of all episodes in an environment, or of a stratum of them.
struct Row {
    env_id: EnvId,
    stratum: Option<&'static str>,
    summary: Summary,
}

pub fn run(tasks: &impl Tasks, args: &Args) -> anyhow::Result<bool> {
    let (run, policy) = (&args.episodes, &args.policy);
    let threads = run.threads()?;
    let bar = progress::bar(run.episodes.get().saturating_mul(args.env_id.len()), "episodes");
    let mut rows = Vec::new();
    for &env_id in &args.env_id {
        let evaluation = run.evaluate(tasks, &run.config(env_id), policy, &threads, &bar)?;
        rows.push(Row { env_id, stratum: None, summary: evaluation.summary()? });
        let strata = evaluation.strata(|episode| stratum(env_id.task, episode));
        for (stratum, part) in strata.into_iter().filter(|(stratum, _)| stratum.is_some()) {
            rows.push(Row { env_id, stratum, summary: part.summary()? });
        }
    }
    bar.finish_and_clear();
    say!("evaluate: {policy}, {} episodes; 95 % intervals", run.episodes)?;
    print(&rows, OUTCOME)?;
    say!("")?;
    print(&rows, CONTROLS)?;
    write_results(args.json.as_ref(), args, rows.iter().flat_map(Row::figures))?;
    Ok(true)
}

/// Prints each figure of each row with its 95 % interval.
fn print(rows: &[Row], figures: &[Figure]) -> anyhow::Result<()> {
    let columns: Vec<_> = figures.iter().map(|figure| figure.column).collect();
    say!("| environment | {} |\n|---|{}", columns.join(" | "), "---|".repeat(figures.len()))?;
    for row in rows {
        let cells = figures.iter().map(|Figure { decimals, of, .. }| match of(&row.summary) {
            Some(Estimate { value, low, high }) => {
                format!(" {value:.decimals$} ({low:.decimals$} to {high:.decimals$}) |")
            }
            None => " - |".into(),
        });
        let stratum = row.stratum.map_or(String::new(), |stratum| format!(", {stratum}"));
        say!("| {}{stratum} |{}", row.env_id, cells.collect::<String>())?;
    }
    Ok(())
}

impl Row {
    /// Returns each figure and the ends of its interval, which a single episode does not have.
    fn figures(&self) -> Vec<(String, Metric)> {
        let mut figures = Vec::new();
        let stratum = self.stratum.map_or(String::new(), |name| name.replace(' ', "-") + "/");
        for Figure { name, unit, of, .. } in OUTCOME.iter().chain(CONTROLS) {
            let Some(Estimate { value, low, high }) = of(&self.summary) else { continue };
            let name = format!("evaluate/{}/{stratum}{name}", self.env_id);
            let ends = [(format!("{name}/low"), low), (format!("{name}/high"), high)];
            figures.push((name, Metric::new(value, unit)));
            let ends = ends.into_iter().filter(|(_, end)| end.is_finite());
            figures.extend(ends.map(|(name, end)| (name, Metric::new(end, unit))));
        }
        figures
    }
}
