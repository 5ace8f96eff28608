//! Python environments in the cache, which pip makes on first use.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};
use fetch_sim::{MujocoVersion, cache_folder};

/// The version of MuJoCo in [`REFERENCE`].
pub const MUJOCO: &str = "3.6.0";
/// The packages of the real environment.
pub const REFERENCE: [&str; 3] = ["gymnasium-robotics==1.4.2", "gymnasium==1.4.0", "mujoco==3.6.0"];
const ENVPOOL: &str = "envpool==1.2.5";

/// The package of the replay buffer to compare with.
pub const STABLE_BASELINES3: [&str; 1] = ["stable-baselines3==2.9.2"];
/// The script that runs it.
pub const SB3_SCRIPT: &str = include_str!("../../scripts/sb3.py");

/// Returns the interpreter of the environment with gymnasium-robotics and EnvPool.
pub fn peers() -> anyhow::Result<PathBuf> {
    environment("python-peers", &[&REFERENCE[..], &[ENVPOOL]].concat())
}

/// Returns the interpreter of the environment of a name, with these packages.
pub fn environment(name: &str, packages: &[&str]) -> anyhow::Result<PathBuf> {
    let folder = cache_folder()?.join(name);
    let python = folder.join("bin/python");
    let complete = folder.join("complete");
    let packages_in = packages.join("\n");
    if fs::read_to_string(&complete).is_ok_and(|complete| complete == packages_in) {
        return Ok(python);
    }
    println!("making a Python environment in {}", folder.display());
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(packages))?;
    fs::write(complete, packages_in)?;
    Ok(python)
}

/// Runs a script that records the real environment into a folder, with a library of OpenGL.
pub fn record(into: &Path, script: &str, arguments: &[&str], gl: &str) -> anyhow::Result<()> {
    let version = MujocoVersion::of_library()?.to_string();
    ensure!(
        version == MUJOCO,
        "this is built on MuJoCo {version}, and the live environment runs on {MUJOCO}: run \
         `cargo xtask mujoco {MUJOCO}` and set MUJOCO_DIR as it says"
    );
    let path = into.join("record.py");
    fs::write(&path, script)?;
    run(Command::new(environment("python", &REFERENCE)?)
        .args([&path, Path::new("--out"), into])
        .args(arguments)
        .env("MUJOCO_GL", gl)
        .env("PYTHONWARNINGS", "ignore"))
}

/// Runs a command to its end.
pub fn run(command: &mut Command) -> anyhow::Result<()> {
    let status = command.status().with_context(|| format!("{command:?} did not start"))?;
    ensure!(status.success(), "{command:?} failed: run this again");
    Ok(())
}
