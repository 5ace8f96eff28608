//! Runs the real environment in Python.

use std::{fs, path::Path, process::Command};

use anyhow::{Context, ensure};
use fetch_sim::MujocoVersion;

use crate::shared::python::{self, MUJOCO};

const SCRIPT: &str = include_str!("../../scripts/record.py");

/// Records fresh episodes of every task into a folder.
pub fn record(into: &Path, episodes: u16, seed: u64) -> anyhow::Result<()> {
    println!("recording {episodes} episodes a task and kind from seed {seed} in Python");
    let (episodes, seed) = (episodes.to_string(), seed.to_string());
    run_script(into, SCRIPT, &["--episodes", &episodes, "--seed", &seed], "disable")
}

/// Runs a script that records the real environment into a folder, with a library of OpenGL.
pub fn run_script(into: &Path, script: &str, arguments: &[&str], gl: &str) -> anyhow::Result<()> {
    let version = MujocoVersion::of_library()?.to_string();
    ensure!(
        version == MUJOCO,
        "this is built on MuJoCo {version}, and the live environment runs on {MUJOCO}: run \
         `cargo xtask mujoco {MUJOCO}` and set MUJOCO_DIR as it says"
    );
    let python = python::environment("python", &python::REFERENCE)?;
    let path = into.join("record.py");
    fs::write(&path, script)?;
    let status = Command::new(python)
        .arg(&path)
        .arg("--out")
        .arg(into)
        .args(arguments)
        .env("MUJOCO_GL", gl)
        .env("PYTHONWARNINGS", "ignore")
        .status()
        .context("the Python environment did not start")?;
    ensure!(status.success(), "the recording failed");
    Ok(())
}
