//! Recorded trajectories of the real environment, and live ones, replayed step by step.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use fetch_sim::MujocoSimulator;
use serde::Serialize;

use super::{
    Found, Models,
    file_parity::FileParity,
    recording::{Meta, Recording},
    tell_workaround,
};
use crate::shared::python;
use fetch_cli::shared::{choice::ModelChoice, progress};

const SCRIPT: &str = include_str!("../../scripts/record.py");

#[derive(clap::Args, Serialize)]
pub struct FixtureArgs {
    /// Folder of recorded trajectories (*.npz)
    #[arg(long, value_name = "DIR")]
    fixtures: PathBuf,
    /// Model on which to replay
    #[arg(long, value_enum, default_value = "builtin")]
    model: ModelChoice,
}

#[derive(clap::Args, Serialize)]
pub struct LiveArgs {
    /// First seed of the episodes
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Episodes for each task and kind
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u16).range(1..))]
    episodes: u16,
    /// Model on which to replay
    #[arg(long, value_enum, default_value = "reference")]
    model: ModelChoice,
}

/// Replays every recording of a folder.
pub fn compare(args: &FixtureArgs) -> anyhow::Result<Found> {
    replay_all(&args.fixtures, &mut Models::new(args.model.source()))
}

/// Records episodes in Python, and replays them.
pub fn live(args: &LiveArgs) -> anyhow::Result<Found> {
    let folder = tempfile::tempdir()?;
    let (episodes, seed) = (args.episodes.to_string(), args.seed.to_string());
    say!("recording {episodes} episodes per task and kind from seed {seed} in Python")?;
    let arguments = ["--episodes", &episodes, "--seed", &seed];
    python::record(folder.path(), SCRIPT, &arguments, "disable")?;
    replay_all(folder.path(), &mut Models::new(args.model.source()))
}

fn replay_all(folder: &Path, models: &mut Models) -> anyhow::Result<Found> {
    // Reads all files before replaying any, to report a damaged file at once.
    let recordings = recordings_in(folder)?
        .iter()
        .map(|path| Recording::read(path))
        .collect::<anyhow::Result<Vec<_>>>()?;
    if let Some(Meta { mujoco, .. }) = recordings.iter().map(|r| &r.meta).find(|m| m.workaround) {
        tell_workaround(mujoco)?;
    }
    let bar = progress::bar(recordings.len(), "parity");
    say!("{}", FileParity::HEADING)?;
    let mut found = Found::default();
    for recording in &recordings {
        let simulator = MujocoSimulator::from_model(models.get(recording.task)?)?;
        let file = FileParity::measure(recording, simulator)?;
        bar.suspend(|| say!("{}", file.line()))?;
        found.figures.extend(file.figures());
        if !file.passed() {
            found.bad.push(file.name);
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(found)
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
