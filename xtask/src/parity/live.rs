//! The real environment, run beside ours.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, ensure};
use fetch_sim::MujocoVersion;

use crate::python::{self, MUJOCO};

const SCRIPT: &str = include_str!("../../scripts/record.py");

/// Records fresh episodes of every task into a folder.
pub fn record(into: &Path, episodes: u16, seed: u64) -> anyhow::Result<()> {
    let version = MujocoVersion::of_library()?.to_string();
    ensure!(
        version == MUJOCO,
        "this is built on MuJoCo {version}, and the live environment runs on {MUJOCO}: run \
         `cargo xtask mujoco {MUJOCO}` and set MUJOCO_DIR as it says"
    );
    let python = python::environment("python", &python::REFERENCE)?;
    let script = into.join("record.py");
    fs::write(&script, SCRIPT)?;
    println!("recording {episodes} episodes a task and kind from seed {seed} in Python");
    let status = Command::new(python)
        .arg(&script)
        .arg("--out")
        .arg(into)
        .args(["--episodes", &episodes.to_string(), "--seed", &seed.to_string()])
        .env("MUJOCO_GL", "disable")
        .env("PYTHONWARNINGS", "ignore")
        .status()
        .context("the Python environment did not start")?;
    ensure!(status.success(), "the recording failed");
    Ok(())
}
