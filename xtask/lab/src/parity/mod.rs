//! `parity`: compares this project with the real environment: recordings, distributions, pictures,
//! samples.

mod counting;
mod distributions;
mod file_parity;
mod frames;
mod hindsight;
mod npz;
mod policies;
mod recorded;
mod recording;
mod replay;

use std::{path::PathBuf, sync::Arc};

use anyhow::Context;
use fetch_sim::{FetchModel, ModelSource, SimConfig, Task};
use serde::Serialize;

use fetch_cli::shared::{
    check::Check,
    json::{Metric, write_results},
};

#[derive(clap::Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct Args {
    #[command(subcommand)]
    comparison: Option<Comparison>,
    #[command(flatten)]
    recorded: Option<recorded::FixtureArgs>,
    /// Also write the figures as JSON
    #[arg(long, global = true, value_name = "FILE")]
    json: Option<PathBuf>,
}

#[derive(clap::Subcommand)]
enum Comparison {
    /// Run the real environment in Python on fresh seeds, and compare bit for bit
    Live(recorded::LiveArgs),
    /// Compare recorded distributions with those of the same seeds and actions here
    Distributions(distributions::Args),
    /// Render the real environment in Python, and compare the pictures
    Frames(frames::Args),
    /// Sample the replay buffer and Stable-Baselines3's in Python, and compare the distributions
    Hindsight(hindsight::Args),
    /// Run trained policies in Python and here, on the same seeds
    Policies(policies::Args),
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    match &args.comparison {
        Some(Comparison::Live(live)) => args.finish(live, recorded::live(live)?),
        Some(Comparison::Distributions(distributions)) => {
            args.finish(distributions, distributions::compare(distributions)?)
        }
        Some(Comparison::Frames(frames)) => args.finish(frames, frames::compare(frames)?),
        Some(Comparison::Hindsight(hindsight)) => {
            args.finish(hindsight, hindsight::compare(hindsight)?)
        }
        Some(Comparison::Policies(policies)) => args.finish(policies, policies::compare(policies)?),
        None => {
            let recorded = args.recorded.as_ref().context("pass --fixtures or a comparison")?;
            args.finish(recorded, recorded::compare(recorded)?)
        }
    }
}

impl Args {
    /// Writes what a comparison with these settings found, and returns whether all of it is close
    /// enough.
    fn finish(&self, settings: &impl Serialize, found: Found) -> anyhow::Result<bool> {
        let Found { figures, bad } = found;
        write_results(self.json.as_ref(), settings, figures)?;
        if !bad.is_empty() {
            say!("\nnot close enough: {}", bad.join(", "))?;
        }
        Ok(bad.is_empty())
    }
}

/// What a comparison found: its figures, and the names of what is not close enough.
#[derive(Default)]
struct Found {
    figures: Vec<(String, Metric)>,
    bad: Vec<String>,
}

impl Found {
    /// Returns the figures of checks, with a prefix before their names.
    fn of_checks(prefix: &str, checks: Vec<Check>) -> Self {
        let mut found = Self::default();
        for Check { name, passed, figure, .. } in checks {
            found.figures.push((format!("{prefix}{name}"), figure));
            if !passed {
                found.bad.push(name);
            }
        }
        found
    }
}

/// The models of the tasks, each compiled once.
struct Models {
    source: ModelSource,
    loaded: Vec<Arc<FetchModel>>,
}

impl Models {
    const fn new(source: ModelSource) -> Self {
        Self { source, loaded: Vec::new() }
    }

    fn get(&mut self, task: Task) -> anyhow::Result<Arc<FetchModel>> {
        if let Some(model) = self.loaded.iter().find(|model| model.config().task() == task) {
            return Ok(Arc::clone(model));
        }
        let config = SimConfig::new(task).with_model(self.source.clone());
        let model = FetchModel::load(&config)?;
        self.loaded.push(Arc::clone(&model));
        Ok(model)
    }
}

/// Says that the real environment started only with the help of `scripts/start.py`.
fn tell_workaround(mujoco: &str) -> anyhow::Result<()> {
    say!(
        "gymnasium-robotics cannot make a Fetch environment on MuJoCo {mujoco}: an assertion on \
         joint types fails. It ran with int() around those types; nothing else in it was changed."
    )
}
