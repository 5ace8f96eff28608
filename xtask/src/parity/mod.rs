//! `parity`: recordings of the real environment, replayed.

mod counting;
mod recording;
mod replay;

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use fetch_sim::{FetchModel, MujocoSimulator, MujocoVersion, SimConfig, Task};
use serde::Serialize;

use self::{
    recording::Recording,
    replay::{Deviation, EpisodeParity, replay},
};
use crate::{
    progress,
    report::{Figure, Report, write_json},
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
}

#[derive(Serialize)]
struct Settings {
    fixtures: PathBuf,
    model: ModelChoice,
}

/// One file's parity.
struct FileParity {
    name: String,
    episodes: Vec<EpisodeParity>,
    /// Deviation of the settled gripper position and object height.
    settled: f64,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let paths = recordings_in(&args.fixtures)?;
    // Read all before anything is replayed: a damaged file is told at once.
    let recordings =
        paths.iter().map(|path| Recording::read(path)).collect::<anyhow::Result<Vec<_>>>()?;
    let mut models = Models::default();
    let bar = progress::bar(recordings.len(), "parity");
    let mut files = Vec::new();
    println!(
        "{:<24} {:>8} {:>9} {:>9} {:>8}  {:<11} {:<11} {:>9}  worst at",
        "file", "episodes", "bit-equal", "self-cont", "contacts", "free", "overall", "reset"
    );
    for recording in &recordings {
        let file = compare(recording, models.get(recording.task)?)?;
        bar.suspend(|| println!("{}", file.line()));
        files.push(file);
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(path) = &args.json {
        let settings = Settings { fixtures: args.fixtures.clone(), model: args.model };
        write_json(path, &Report::new(settings, files.iter().flat_map(FileParity::figures)))?;
    }
    Ok(true)
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
#[derive(Default)]
struct Models(Vec<std::sync::Arc<FetchModel>>);

impl Models {
    fn get(&mut self, task: Task) -> anyhow::Result<MujocoSimulator> {
        let found = self.0.iter().find(|model| model.config().task == task).cloned();
        let model = match found {
            Some(model) => model,
            None => {
                let model = FetchModel::builtin(&SimConfig::new(task))?;
                self.0.push(model.clone());
                model
            }
        };
        Ok(MujocoSimulator::with_model(model)?)
    }
}

fn compare(recording: &Recording, simulator: MujocoSimulator) -> anyhow::Result<FileParity> {
    use fetch_sim::Simulator;
    let settled = simulator.settled();
    let gripper = settled.gripper_position.as_slice().iter();
    let deviation = gripper
        .chain(&settled.object_height)
        .zip(recording.initial_gripper_xpos.iter().chain(&recording.height_offset))
        .map(|(ours, theirs)| (ours - theirs).abs())
        .fold(0.0, f64::max);
    let name =
        recording.path.file_stem().map_or_else(String::new, |name| name.display().to_string());
    let same_mujoco = recording.meta.mujoco == MujocoVersion::of_headers().to_string();
    let note = if same_mujoco { "" } else { " (other MuJoCo)" };
    Ok(FileParity {
        name: format!("{name}{note}"),
        episodes: replay(recording, simulator)?,
        settled: deviation,
    })
}

impl FileParity {
    fn bit_equal(&self) -> usize {
        self.episodes.iter().filter(|episode| episode.bit_equal).count()
    }

    /// The worst of the episodes in which the real robot does not touch itself.
    fn free(&self) -> Deviation {
        Deviation::max(
            self.episodes.iter().filter(|e| e.self_contacts[1] == 0).map(|e| &e.deviation),
        )
    }

    fn overall(&self) -> Deviation {
        Deviation::max(self.episodes.iter().map(|e| &e.deviation))
    }

    /// Episodes in which self-contact occurs in both or in neither.
    fn self_contact_agreement(&self) -> usize {
        let agrees = |e: &&EpisodeParity| (e.self_contacts[0] > 0) == (e.self_contacts[1] > 0);
        self.episodes.iter().filter(agrees).count()
    }

    /// The largest relative difference in an episode's contacts.
    fn contact_difference(&self) -> f64 {
        let difference = |e: &EpisodeParity| {
            let [ours, theirs] = e.contacts.map(|count| count as f64);
            (ours - theirs).abs() / theirs.max(1.0)
        };
        self.episodes.iter().map(difference).fold(0.0, f64::max)
    }

    fn line(&self) -> String {
        let total = self.episodes.len();
        let overall = self.overall();
        let reset =
            Deviation::max(self.episodes.iter().map(|e| &e.at_reset)).size.max(self.settled);
        format!(
            "{:<24} {total:>8} {:>6}/{total:<2} {:>6}/{total:<2} {:>7.1}%  {:<11.3e} {:<11.3e} {:>9.1e}  {}",
            self.name,
            self.bit_equal(),
            self.self_contact_agreement(),
            100.0 * self.contact_difference(),
            self.free().size,
            overall.size,
            reset,
            overall.place,
        )
    }

    fn figures(&self) -> Vec<(String, Figure)> {
        let figure = |name: &str, value, unit| {
            (format!("parity/{}/{name}", self.name), Figure::new(value, unit))
        };
        let returns = |side: usize| self.episodes.iter().map(|e| e.returns[side]).sum::<f64>();
        let total = self.episodes.len() as f64;
        vec![
            figure("episodes", total, "1"),
            figure("bit-equal", self.bit_equal() as f64 / total, "1"),
            figure("free-deviation", self.free().size, "1"),
            figure("deviation", self.overall().size, "1"),
            figure("settled-deviation", self.settled, "m"),
            figure("contact-difference", self.contact_difference(), "1"),
            figure("self-contact-agreement", self.self_contact_agreement() as f64 / total, "1"),
            figure("return-mean", returns(0) / total, "1"),
            figure("return-mean-recorded", returns(1) / total, "1"),
        ]
    }
}
