//! `bench`: measures speed and memory. Contenders take turns within one run, so that ratios hold on
//! a busy machine; absolute figures need a quiet one.

mod env;
mod her;
mod instructions;
mod interleaved;
mod learn;
mod peer;
mod ranks;
mod render;
mod reward;

use std::{ffi::OsStr, fmt, path::PathBuf, process::Command};

use anyhow::ensure;
use fetch_env::{
    FetchConfig, Task,
    variation::{Draw, Variation},
};
use goal_reward::RewardKind;
use serde::Serialize;

use fetch_cli::shared::{
    choice::{ModelChoice, flag_name, task_name},
    json::{Metric, write_results},
};

#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: Benchmark,
    /// Also write the figures as JSON
    #[arg(long, global = true)]
    json: Option<PathBuf>,
}

#[derive(clap::Subcommand)]
enum Benchmark {
    /// Measure steps and resets of environments, their construction and memory
    Env(env::Args),
    /// Measure sampling from the replay buffer, adding to it, and its memory
    Her(her::Args),
    /// Count the instructions of a step and a reset with valgrind
    Instructions(instructions::Args),
    /// Measure updates of a learner, compared with a plain matrix product
    Learn(learn::Args),
    /// Measure how long ranks take to average gradients, through MPI
    Ranks(ranks::Args),
    /// Measure pictures per second, compared with pictures of the sky alone
    Render(render::Args),
    /// Measure rewards of a million pairs of goals, compared with copying as many bytes
    Reward(reward::Args),
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let path = args.json.as_ref();
    match &args.what {
        Benchmark::Env(args) => {
            let peers = args.start_peers()?;
            let figures = env::run(args, peers.as_ref())?;
            write_results(path, env::Settings::new(args, peers.as_ref()), figures)
        }
        Benchmark::Her(args) => write_results(path, args, her::run(args)?),
        Benchmark::Instructions(args) => write_results(path, args, instructions::run(args)?),
        Benchmark::Learn(args) => write_results(path, args, learn::run(args)?),
        Benchmark::Ranks(args) => return ranks::run(args, path),
        Benchmark::Render(args) => {
            let figures = render::run(args)?;
            write_results(path, render::Settings::new(args)?, figures)
        }
        Benchmark::Reward(args) => write_results(path, args, reward::run(args)?),
    }?;
    Ok(true)
}

/// The flags `--task` and `--model`.
#[derive(Clone, Copy, Debug, clap::Args, Serialize)]
pub struct Subjects {
    /// Measure only this task
    #[arg(long, value_parser = parse_task)]
    task: Option<Task>,
    /// Measure only this model
    #[arg(long, value_enum)]
    model: Option<ModelChoice>,
}

#[derive(Clone, Copy, Debug)]
pub struct Subject {
    pub task: Task,
    pub model: ModelChoice,
}

impl Subjects {
    pub fn all(&self) -> Vec<Subject> {
        let tasks = self.task.map_or_else(|| Task::ALL.to_vec(), |task| vec![task]);
        let both = [ModelChoice::Builtin, ModelChoice::Reference];
        let models = self.model.map_or_else(|| both.to_vec(), |model| vec![model]);
        let of = |task| models.iter().map(move |&model| Subject { task, model });
        tasks.into_iter().flat_map(of).collect()
    }
}

impl Subject {
    pub fn config(self) -> FetchConfig {
        FetchConfig::new(self.task, RewardKind::Sparse).with_model(self.model.source())
    }

    /// Returns the settings in which resets draw friction and, where there is an object, its mass and
    /// size. `plain` draws the model's own numbers instead.
    fn varied(self, plain: bool) -> anyhow::Result<FetchConfig> {
        let draw =
            |low, high, model| if plain { Draw::Fixed(model) } else { Draw::Uniform(low, high) };
        let mut variation = Variation::default().with("friction", draw(0.5, 2.0, 1.0))?;
        if self.task.has_object() {
            variation = variation
                .with("object_mass", draw(0.5, 4.0, 2.0))?
                .with("object_size", draw(0.8, 1.2, 1.0))?;
        }
        Ok(self.config().with_variation(variation))
    }

    /// Returns the flags that select it, with a space between them.
    pub fn flags(self) -> String {
        format!("--task {} --model {}", flag_of(self.task), flag_name(self.model))
    }
}

impl fmt::Display for Subject {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", flag_of(self.task), flag_name(self.model))
    }
}

fn parse_task(name: &str) -> Result<Task, String> {
    let found = Task::ALL.into_iter().find(|task| flag_of(*task) == name);
    found.ok_or_else(|| format!("the tasks are {}", Task::ALL.map(flag_of).join(", ")))
}

fn flag_of(task: Task) -> String {
    task_name(task).replace('_', "-")
}

/// Prints the figures of a measurement with a prefix, and keeps them.
fn report(
    figures: &mut Vec<(String, Metric)>,
    prefix: &str,
    measured: impl IntoIterator<Item = (String, Metric)>,
) -> anyhow::Result<()> {
    for (name, figure) in measured {
        let name = format!("{prefix}/{name}");
        say!("{name:<54} {figure}")?;
        figures.push((name, figure));
    }
    Ok(())
}

/// Runs this program again with other arguments, and returns its output. Earlier allocations would
/// distort a measurement of memory in this process.
fn measure_in_new_process(
    arguments: impl IntoIterator<Item: AsRef<OsStr>>,
) -> anyhow::Result<String> {
    let output = Command::new(std::env::current_exe()?).args(arguments).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "the measurement of memory failed: {errors}");
    Ok(String::from_utf8(output.stdout)?)
}
