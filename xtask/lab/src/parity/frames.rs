//! Compares the pictures of the real environment with ours.

use std::path::Path;

use anyhow::{Context, ensure};
use fetch_env::{Env, EnvId, FetchConfig, FetchEnv, RenderEnv, RenderOptions, Renderer};
use fetch_sim::{ModelSource, MujocoSimulator, MujocoVersion, Task};
use goal_reward::RewardKind;
use serde::Serialize;

use super::{Found, Models, npz::Npz, tell_workaround};
use crate::shared::python;
use fetch_cli::shared::{
    check::{self, Check},
    choice::task_name,
    json::Metric,
};

const SCRIPT: &str = include_str!("../../scripts/frames.py");
/// The largest accepted mean difference between pictures, on a scale of 255.
const TOLERANCE: f64 = 1.0;

#[derive(clap::Args, Serialize)]
pub struct Args {
    /// Seed of the episodes
    #[arg(long, default_value_t = 0)]
    seed: u64,
}

/// Renders an episode of every task in Python and here, and compares each picture.
pub fn compare(&Args { seed }: &Args) -> anyhow::Result<Found> {
    let (folder, mut models) = (tempfile::tempdir()?, Models::new(ModelSource::Reference));
    let folder = folder.path();
    let config =
        |task| FetchConfig::new(task, RewardKind::Sparse).with_model(ModelSource::Reference);
    // Fails early if there is no OpenGL here.
    let renderer = |task| -> anyhow::Result<Renderer> {
        Ok(Renderer::new(config(task).sim(), RenderOptions::default())?)
    };
    drop(renderer(Task::Reach)?);
    let backend = Renderer::backend().context("a renderer was made")?.to_lowercase();
    python::record(folder, SCRIPT, &["--seed", &seed.to_string()], &backend)?;
    let mut checks = Vec::new();
    for task in Task::ALL {
        let file = format!("{}.npz", task_name(task));
        let recorded = Recorded::read(&folder.join(&file)).context(file)?;
        if recorded.workaround && task == Task::ALL[0] {
            tell_workaround(&MujocoVersion::of_library()?.to_string())?;
        }
        let simulator = MujocoSimulator::from_model(models.get(task)?)?;
        let mut env = FetchEnv::new(config(task), simulator)?.time_limited();
        let mut renderer = renderer(task)?;
        env.reset(Some(seed))?;
        let mut differences = vec![difference(env.render(&mut renderer)?, recorded.frame(0))?];
        for (step, action) in (1..).zip(recorded.actions.chunks_exact(4)) {
            env.step(action)?;
            if step % recorded.every == 0 {
                let theirs = recorded.frame(step / recorded.every);
                differences.push(difference(env.render(&mut renderer)?, theirs)?);
            }
        }
        let name = format!("frames/{}", EnvId { task, reward: RewardKind::Sparse });
        checks.push(judge(&name, &differences));
    }
    check::print("pictures, 480 x 480; differences of colors on a scale of 255", &checks)?;
    Ok(Found::of_checks("", checks))
}

fn judge(name: &str, differences: &[f64]) -> Check {
    let equal = differences.iter().filter(|&&mean| mean == 0.0).count();
    let largest = differences.iter().copied().fold(0.0, f64::max);
    let seen =
        format!("{equal} of {} equal, largest mean difference {largest:.1e}", differences.len());
    Check::new(name, largest < TOLERANCE, seen, Metric::new(largest, "1"))
}

/// Returns the mean difference between the colors of two pictures.
fn difference(ours: &[u8], theirs: &[u8]) -> anyhow::Result<f64> {
    ensure!(ours.len() == theirs.len(), "the pictures differ in size");
    let sum: u64 = ours.iter().zip(theirs).map(|(&a, &b)| u64::from(a.abs_diff(b))).sum();
    Ok(sum as f64 / ours.len() as f64)
}

struct Recorded {
    every: usize,
    actions: Vec<f32>,
    frames: Vec<u8>,
    frame_len: usize,
    workaround: bool,
}

impl Recorded {
    fn read(path: &Path) -> anyhow::Result<Self> {
        let mut file = Npz::open(path)?;
        let every = usize::try_from(file.vector::<i64>("every", 1)?[0])?;
        let workaround = file.vector::<i64>("workaround", 1)?[0] != 0;
        let (actions, _) = file.array("actions")?;
        let (frames, shape) = file.array("frames")?;
        ensure!(shape.len() == 4 && every > 0, "its frames have the shape {shape:?}");
        ensure!(shape[0] > actions.len() / 4 / every, "it has too few frames");
        Ok(Self { every, actions, frames, frame_len: shape[1..].iter().product(), workaround })
    }

    fn frame(&self, index: usize) -> &[u8] {
        &self.frames[index * self.frame_len..][..self.frame_len]
    }
}
