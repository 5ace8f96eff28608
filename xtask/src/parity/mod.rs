//! `parity`: recordings of the real environment, replayed.

mod counting;
mod file_parity;
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
    progress,
    report::{Report, write_json},
};

#[derive(clap::Args)]
pub struct Args {
    /// Folder of recordings (*.npz)
    #[arg(long)]
    fixtures: PathBuf,
    /// Which model to replay them on
    #[arg(long, value_enum, default_value_t = ModelChoice::Builtin)]
    model: ModelChoice,
    /// Also write the figures as JSON
    #[arg(long)]
    json: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum, Serialize)]
#[serde(rename_all = "lowercase")]
enum ModelChoice {
    Builtin,
    Reference,
}

impl ModelChoice {
    fn source(self) -> ModelSource {
        match self {
            Self::Builtin => ModelSource::Builtin,
            Self::Reference => ModelSource::Reference,
        }
    }
}

#[derive(Serialize)]
struct Settings {
    fixtures: PathBuf,
    model: ModelChoice,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let paths = recordings_in(&args.fixtures)?;
    // Read all before anything is replayed: a damaged file is told at once.
    let recordings =
        paths.iter().map(|path| Recording::read(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let mut models = Models { source: args.model.source(), loaded: Vec::new() };
    let bar = progress::bar(recordings.len(), "parity");
    let mut files = Vec::new();
    println!("{}", FileParity::HEADING);
    for recording in &recordings {
        let file = FileParity::measure(recording, models.get(recording.task)?)?;
        bar.suspend(|| println!("{}", file.line()));
        files.push(file);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(path) = &args.json {
        let settings = Settings { fixtures: args.fixtures.clone(), model: args.model };
        write_json(path, &Report::new(settings, files.iter().flat_map(FileParity::figures)))?;
    }
    let bad: Vec<&str> = files.iter().filter(|f| !f.passed()).map(|f| f.name.as_str()).collect();
    if !bad.is_empty() {
        println!("\nnot as close as it should be: {}", bad.join(", "));
    }
    Ok(bad.is_empty())
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
    fn get(&mut self, task: Task) -> anyhow::Result<MujocoSimulator> {
        if let Some(model) = self.loaded.iter().find(|model| model.config().task == task) {
            return Ok(MujocoSimulator::with_model(Arc::clone(model))?);
        }
        let config = SimConfig { model: self.source.clone(), ..SimConfig::new(task) };
        let model = FetchModel::load(&config)?;
        self.loaded.push(Arc::clone(&model));
        Ok(MujocoSimulator::with_model(model)?)
    }
}
