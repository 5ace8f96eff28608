//! `parity`: compares ours with the real environment: recordings, distributions, pictures, samples.

mod counting;
mod distributions;
mod file_parity;
mod frames;
mod hindsight;
mod npz;
mod policies;
mod recording;
mod replay;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, ensure};
use fetch_sim::{FetchModel, ModelSource, MujocoSimulator, SimConfig, Task};
use serde::Serialize;

use self::{
    file_parity::FileParity,
    recording::{Meta, Recording},
};
use crate::shared::{
    check::{self, Check},
    choice::ModelChoice,
    json::write_results,
    progress, python,
};

#[derive(Clone, clap::Args, Serialize)]
pub struct Args {
    /// Folder of recorded trajectories (*.npz)
    #[arg(long, required_unless_present_any = ["distributions", "live", "frames", "hindsight", "policies"])]
    fixtures: Option<PathBuf>,
    /// Run the real environment in Python on fresh seeds, and compare bit for bit
    #[arg(long, conflicts_with_all = ["fixtures", "distributions"])]
    live: bool,
    /// Render the real environment in Python, and compare the pictures
    #[arg(long, conflicts_with_all = ["fixtures", "distributions", "model", "live"])]
    frames: bool,
    /// First seed of the live episodes and of the policies', or seed of the pictures
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// File of recorded distributions (*.npz)
    #[arg(long)]
    distributions: Option<PathBuf>,
    /// Episodes for each task's distributions (default 400), or live for each task and kind
    /// (default 3), or of each policy (default 100)
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    episodes: Option<u16>,
    /// Sample the replay buffer and Stable-Baselines3's in Python, and compare the distributions
    #[arg(long, conflicts_with_all = ["fixtures", "distributions", "live", "model"])]
    hindsight: bool,
    /// Run the trained policies of baselines, or those of files, in Python and here, on the same
    /// seeds
    #[arg(long, num_args = 0.., value_name = "FILE", conflicts_with_all = ["fixtures", "distributions", "live", "frames", "hindsight", "model"])]
    policies: Option<Vec<PathBuf>>,
    /// Rows to sample from each buffer by each strategy
    #[arg(long, default_value_t = 100_000, requires = "hindsight")]
    #[arg(value_parser = clap::value_parser!(u32).range(1000..))]
    rows: u32,
    /// Model on which to replay: the reference's by default with --live and --frames, else the
    /// built-in
    #[arg(long, value_enum)]
    model: Option<ModelChoice>,
    /// Also write the figures as JSON
    #[arg(long)]
    #[serde(skip)]
    json: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let usual =
        if args.live || args.frames { ModelChoice::Reference } else { ModelChoice::Builtin };
    let model = args.model.unwrap_or(usual);
    let args = &Args { model: Some(model), ..args.clone() };
    let mut models = Models { source: model.source(), loaded: Vec::new() };
    let recorded = tempfile::tempdir()?;
    let live = args.live.then_some(recorded.path());
    if let Some(folder) = live {
        const SCRIPT: &str = include_str!("../../scripts/record.py");
        let (episodes, seed) = (args.episodes.unwrap_or(3).to_string(), args.seed.to_string());
        say!("recording {episodes} episodes a task and kind from seed {seed} in Python")?;
        let arguments = ["--episodes", &episodes, "--seed", &seed];
        python::record(folder, SCRIPT, &arguments, "disable")?;
    }
    let mut figures = Vec::new();
    let mut bad = Vec::new();
    if let Some(folder) = args.fixtures.as_deref().or(live) {
        for file in replay_all(folder, &mut models)? {
            if !file.passed() {
                bad.push(file.name.clone());
            }
            figures.extend(file.figures());
        }
    }
    let mut checks = Vec::new();
    if let Some(path) = &args.distributions {
        let compared = compare_all(path, &mut models, args.episodes.unwrap_or(400).into())?;
        checks.push(("distributions/", compared));
    }
    if args.hindsight {
        checks.push(("hindsight/", hindsight::compare(args.rows as usize)?));
    }
    if args.frames {
        checks.push(("", frames::compare(recorded.path(), &mut models, args.seed)?));
    }
    if let Some(files) = &args.policies {
        let episodes = args.episodes.unwrap_or(100).into();
        let compared = policies::compare(recorded.path(), files, episodes, args.seed)?;
        checks.push(("policies/", compared));
    }
    for (prefix, checks) in checks {
        for check in checks {
            if !check.passed {
                bad.push(check.name.clone());
            }
            figures.push((format!("{prefix}{}", check.name), check.figure));
        }
    }
    write_results(args.json.as_ref(), args, figures)?;
    if !bad.is_empty() {
        say!("\nnot as close as it should be: {}", bad.join(", "))?;
    }
    Ok(bad.is_empty())
}

fn replay_all(folder: &Path, models: &mut Models) -> anyhow::Result<Vec<FileParity>> {
    // Reads all before it replays any, to report a damaged file at once.
    let recordings = recordings_in(folder)?
        .iter()
        .map(|path| Recording::read(path))
        .collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(Meta { mujoco, .. }) = recordings.iter().map(|r| &r.meta).find(|m| m.workaround) {
        tell_workaround(mujoco)?;
    }
    let bar = progress::bar(recordings.len(), "parity");
    say!("{}", FileParity::HEADING)?;
    let mut files = Vec::new();
    for recording in &recordings {
        let simulator = MujocoSimulator::from_model(models.get(recording.task)?)?;
        let file = FileParity::measure(recording, simulator)?;
        bar.suspend(|| say!("{}", file.line()))?;
        files.push(file);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(files)
}

/// Says that the real environment started only with the help of `scripts/start.py`.
fn tell_workaround(mujoco: &str) -> anyhow::Result<()> {
    say!(
        "gymnasium-robotics cannot make a Fetch environment on MuJoCo {mujoco}: an assertion on joint \
         types fails. It ran with int() around those types; nothing else of it was changed."
    )
}

fn compare_all(path: &Path, models: &mut Models, episodes: usize) -> anyhow::Result<Vec<Check>> {
    let bar = progress::bar(Task::ALL.len() * episodes, "distributions");
    let mut all = Vec::new();
    for task in Task::ALL {
        let checks = distributions::compare(path, task, models.get(task)?, episodes, &bar)?;
        bar.suspend(|| check::print(&format!("{task}, {episodes} episodes"), &checks))?;
        all.extend(checks);
    }
    bar.finish_and_clear();
    Ok(all)
}

fn recordings_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read {}", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<anyhow::Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "npz"));
    paths.sort();
    ensure!(!paths.is_empty(), "{} holds no recordings (*.npz)", folder.display());
    Ok(paths)
}

/// The models of the tasks, each compiled once.
struct Models {
    source: ModelSource,
    loaded: Vec<Arc<FetchModel>>,
}

impl Models {
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
