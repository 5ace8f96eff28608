//! Handing commands on: to the package `lab` those that only developers run and that step
//! environments, to the program all others.

use std::{ffi::OsString, process::Command};

use anyhow::{Context, bail, ensure};
use fetch_install::{NONE, Places};

use crate::{c_compiler, tools::ROOT};

/// The commands that the program also has without its default features: the first ones that a
/// newcomer runs, which are built several times as fast without the learner and the plots.
const QUICK: [&str; 10] = [
    "verify",
    "bridge",
    "describe",
    "reward-check",
    "random-episodes",
    "all",
    "exercise",
    "doctor",
    "mujoco",
    "assets",
];

/// The arguments of a command that is handed on, which parses them itself.
#[derive(clap::Args)]
#[command(disable_help_flag = true)]
pub struct Rest {
    #[arg(trailing_var_arg = true, allow_hyphen_values = true, hide = true)]
    _arguments: Vec<OsString>,
}

/// Hands a command on to the program, and returns its exit code.
pub fn to_program(arguments: &[OsString]) -> anyhow::Result<u8> {
    let name = arguments[0].to_str().unwrap_or_default();
    let mut set = None;
    match (missing_mujoco(), name) {
        (None, _) => {}
        // It may be what fetches MuJoCo.
        (Some(_), "mujoco" | "assets") => set = Some(("MUJOCO_DIR", NONE)),
        (Some(missing), "doctor") => {
            // Doctor's first finding; without MuJoCo, it cannot look for anything else.
            say!("FAIL  MuJoCo is missing\n      {missing}\n      fix: {FIX}")?;
            return Ok(1);
        }
        (Some(missing), _) => bail!("{missing}: {FIX}"),
    }
    let mut run = cargo_run("baselines/program", arguments)?;
    run.envs(set);
    if QUICK.contains(&name) {
        run.arg("--no-default-features");
    }
    replace_by(run.arg("--").args(arguments))
}

/// Hands a command on to the package `lab`, and returns its exit code.
pub fn to_lab(arguments: &[OsString]) -> anyhow::Result<u8> {
    if let Some(missing) = missing_mujoco() {
        bail!("{missing}: {FIX}");
    }
    let mut run = cargo_run("xtask/lab", arguments)?;
    // Flags of `bench` may stand between the two words.
    if arguments[0] == "bench" && arguments.iter().any(|argument| argument == "learn") {
        run.args(["--features", "product"]);
    }
    replace_by(run.arg("--").args(arguments))
}

const FIX: &str = "apt-get update && apt-get install -y libmujoco-dev, or `cargo xtask mujoco \
    3.6.0`";

/// Returns why MuJoCo cannot be used; `None` if it can. This is known before anything is built.
fn missing_mujoco() -> Option<String> {
    match Places::of_machine().find(c_compiler) {
        Ok(Some(_)) => None,
        Ok(None) => Some("MuJoCo's headers were not found".to_owned()),
        Err(wrong) => Some(wrong.to_string()),
    }
}

/// Returns the command that builds the package in a folder and runs it, with MPI if `--mpi` is
/// among the arguments.
fn cargo_run(folder: &str, arguments: &[OsString]) -> anyhow::Result<Command> {
    // In this folder, because arguments may be paths.
    let mut run = Command::new(env!("CARGO"));
    run.args(["run", "--quiet", "--release", "--manifest-path"]);
    run.arg(format!("{ROOT}/{folder}/Cargo.toml"));
    if arguments.iter().any(|argument| argument == "--mpi") {
        let mpicc = std::env::var_os("MPICC").unwrap_or_else(|| "mpicc".into());
        let is_there = Command::new(&mpicc).arg("-show").output().is_ok();
        ensure!(
            is_there,
            "--mpi needs MPI and Clang, and there is no {}: apt-get update && apt-get install -y \
             libopenmpi-dev openmpi-bin libclang-dev",
            mpicc.display()
        );
        run.args(["--features", "mpi"]);
    }
    Ok(run)
}

/// Replaces this process with a command, so that the command receives its signals; or, where
/// processes cannot be replaced, runs it and returns its exit code.
#[cfg(unix)]
fn replace_by(command: &mut Command) -> anyhow::Result<u8> {
    // It returns only if it fails.
    Err(std::os::unix::process::CommandExt::exec(command)).context("cargo did not start")
}

#[cfg(not(unix))]
fn replace_by(command: &mut Command) -> anyhow::Result<u8> {
    let status = command.status().context("cargo did not start")?;
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}
