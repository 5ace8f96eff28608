//! `figures`: draws the chapter's pictures, and Slide's, as PNG and SVG.

pub mod canvas;
pub mod chart;
pub mod heat_map;
mod observation;
pub mod picture;
mod rewards;
mod scene;

use std::{fs, path::PathBuf};

use anyhow::Context;
use fetch_sim::Task;

pub use self::{canvas::save, scene::Scene};
use self::{observation::ObservationLayout, rewards::RewardCurves};
use crate::shared::choice::task_name;

#[derive(clap::Args)]
pub struct Args {
    /// Folder into which to write the pictures
    #[arg(long)]
    out: PathBuf,
    /// Seed of the resets; with the default, PickAndPlace's target is in the air
    #[arg(long, default_value_t = 3)]
    seed: u64,
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    fs::create_dir_all(&args.out)
        .with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    for task in Task::ALL {
        save(&Scene::after_reset(task, args.seed)?, &args.out, task_name(task))?;
    }
    save(&ObservationLayout, &args.out, "observation")?;
    save(&RewardCurves, &args.out, "rewards")?;
    Ok(true)
}
