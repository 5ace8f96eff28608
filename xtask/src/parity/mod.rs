//! `parity`: recordings of the real environment, replayed.

mod counting;
mod distributions;
mod file_parity;
mod frames;
mod hindsight;
mod live;
mod npz;
mod recording;
mod replay;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, ensure};
use fetch_sim::{FetchModel, ModelSource, MujocoSimulator, SimConfig, Task};
use serde::Serialize;

use self::{file_parity::FileParity, recording::Recording};
use crate::{
    check::{self, Check},
    env_choice::ModelChoice,
    progress,
    report::{Report, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    /// Folder of recorded trajectories (*.npz)
    #[arg(long, required_unless_present_any = ["distributions", "live", "frames", "hindsight"])]
    fixtures: Option<PathBuf>,
    /// Run the real environment in Python on fresh seeds, and compare bit for bit
    #[arg(long, conflicts_with_all = ["fixtures", "distributions", "model"])]
    live: bool,
    /// Render the real environment in Python, and compare the pictures
    #[arg(long, conflicts_with_all = ["fixtures", "distributions", "model", "live"])]
    frames: bool,
    /// First seed of the live episodes, or the one of the pictures'
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// File of recorded distributions (*.npz)
    #[arg(long)]
    distributions: Option<PathBuf>,
    /// Episodes: of each task's distributions (400 by default), or live of each task and kind (3)
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..))]
    episodes: Option<u16>,
    /// Sample the replay buffer and Stable-Baselines3's in Python, and compare the distributions
    #[arg(long, conflicts_with_all = ["fixtures", "distributions", "live", "model"])]
    hindsight: bool,
    /// Rows to sample from each by each strategy
    #[arg(long, default_value_t = 100_000, requires = "hindsight")]
    #[arg(value_parser = clap::value_parser!(u32).range(1000..))]
    rows: u32,
    /// Which model to replay them on
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Serialize)]
struct Settings<'a> {
    hindsight: bool,
    rows: u32,
    live: bool,
    frames: bool,
    seed: u64,
    fixtures: &'a Option<PathBuf>,
    distributions: &'a Option<PathBuf>,
    episodes: Option<u16>,
    model: ModelChoice,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let model = if args.live || args.frames { ModelChoice::Reference } else { args.model };
    let mut models = Models { source: model.source(), loaded: Vec::new() };
    let recorded = tempfile::tempdir()?;
    let live = args.live.then(|| recorded.path().to_path_buf());
    if let Some(folder) = &live {
        live::record(folder, args.episodes.unwrap_or(3), args.seed)?;
    }
    let mut figures = Vec::new();
    let mut bad = Vec::new();
    if let Some(folder) = args.fixtures.as_ref().or(live.as_ref()) {
        for file in replay_all(folder, &mut models)? {
            if !file.passed() {
                bad.push(file.name.clone());
            }
            figures.extend(file.figures());
        }
    }
    if let Some(path) = &args.distributions {
        for check in compare_all(path, &mut models, args.episodes.unwrap_or(400).into())? {
            if !check.passed {
                bad.push(check.name.clone());
            }
            figures.push((format!("distributions/{}", check.name), check.figure));
        }
    }
    if args.hindsight {
        for check in hindsight::compare(args.rows as usize)? {
            if !check.passed {
                bad.push(check.name.clone());
            }
            figures.push((format!("hindsight/{}", check.name), check.figure));
        }
    }
    if args.frames {
        for check in frames::compare(recorded.path(), &mut models, args.seed)? {
            if !check.passed {
                bad.push(check.name.clone());
            }
            figures.push((check.name, check.figure));
        }
    }
    if let Some(path) = &args.json {
        let Args { fixtures, live, frames, hindsight, rows, .. } = args;
        let Args { seed, distributions, episodes, .. } = args;
        let (live, frames, hindsight, rows) = (*live, *frames, *hindsight, *rows);
        let (seed, episodes) = (*seed, *episodes);
        let settings = Settings {
            hindsight,
            rows,
            live,
            frames,
            seed,
            fixtures,
            distributions,
            episodes,
            model,
        };
        write_json(path, &Report::new(settings, figures))?;
    }
    if !bad.is_empty() {
        println!("\nnot as close as it should be: {}", bad.join(", "));
    }
    Ok(bad.is_empty())
}

fn replay_all(folder: &Path, models: &mut Models) -> anyhow::Result<Vec<FileParity>> {
    // Read all before anything is replayed: a damaged file is told at once.
    let recordings = recordings_in(folder)?
        .iter()
        .map(|path| Recording::read(path))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let bar = progress::bar(recordings.len(), "parity");
    println!("{}", FileParity::HEADING);
    let mut files = Vec::new();
    for recording in &recordings {
        let simulator = MujocoSimulator::from_model(models.get(recording.task)?)?;
        let file = FileParity::measure(recording, simulator)?;
        bar.suspend(|| println!("{}", file.line()));
        files.push(file);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(files)
}

fn compare_all(path: &Path, models: &mut Models, episodes: usize) -> anyhow::Result<Vec<Check>> {
    let bar = progress::bar(Task::ALL.len() * episodes, "distributions");
    let mut all = Vec::new();
    for task in Task::ALL {
        let checks = distributions::compare(path, task, models.get(task)?, episodes, &bar)?;
        bar.suspend(|| check::print(&format!("{task}, {episodes} episodes"), &checks));
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

/// Models, each compiled once.
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
