//! Python environments in the cache, which pip makes on first use.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};
use fetch_sim::{MujocoVersion, cache_folder};

/// The version of MuJoCo on which the peers run, which is EnvPool's.
pub const MUJOCO: &str = "3.6.0";
/// The packages of the real environment, on [`MUJOCO`].
pub const REFERENCE: [&str; 3] = ["gymnasium-robotics==1.4.2", "gymnasium==1.4.0", "mujoco==3.6.0"];
/// The newest version that the interpreter can install.
const ENVPOOL: &str = "envpool";

/// The script that starts the real environments; the recording scripts import it.
const START_SCRIPT: &str = include_str!("../../scripts/start.py");

/// The package of the replay buffer to compare with.
pub const STABLE_BASELINES3: [&str; 1] = ["stable-baselines3==2.9.2"];
/// The packages of the learners to compare with, and of the script that exports their policies.
pub const LEARNERS: [&str; 5] = [
    "stable-baselines3==2.9.2",
    "gymnasium-robotics==1.4.2",
    "gymnasium==1.4.0",
    "mujoco==3.6.0",
    "safetensors",
];
/// The script that runs it.
pub const SB3_SCRIPT: &str = include_str!("../../scripts/sb3.py");

/// The interpreter of the environment with gymnasium-robotics, EnvPool and this project's package.
#[derive(Debug)]
pub struct Peers {
    pub python: PathBuf,
    /// Version of EnvPool.
    pub envpool: String,
}

impl Peers {
    pub fn new() -> anyhow::Result<Self> {
        let python = environment("python-peers", &[&REFERENCE[..], &[ENVPOOL]].concat())?;
        // Without a connection, the installed version stays.
        let upgrade = ["-m", "pip", "install", "--quiet", "--upgrade", ENVPOOL];
        let _ = Command::new(&python).args(upgrade).output();
        install_package(&python)?;
        let version = format!("import importlib.metadata as m; print(m.version('{ENVPOOL}'))");
        let output = Command::new(&python).args(["-c", &version]).output()?;
        ensure!(output.status.success(), "{} has no {ENVPOOL}", python.display());
        Ok(Self { python, envpool: String::from_utf8(output.stdout)?.trim().to_owned() })
    }
}

/// Builds the Python package and installs it.
fn install_package(python: &Path) -> anyhow::Result<()> {
    const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    say!("building the Python package")?;
    let mut install = Command::new(python);
    install.args(["-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps"]);
    install.arg(format!("{ROOT}/fetch-env/python"));
    // It includes the MuJoCo that its build requirements name.
    install.env_remove("MUJOCO_DIR").env("CARGO_TARGET_DIR", format!("{ROOT}/target/python"));
    run(&mut install)
}

/// Returns the interpreter of the environment with this name and these packages.
pub fn environment(name: &str, packages: &[&str]) -> anyhow::Result<PathBuf> {
    let folder = cache_folder().context("the user has no home: set XDG_CACHE_HOME")?.join(name);
    let python = folder.join("bin/python");
    let complete = folder.join("complete");
    let packages_in = packages.join("\n");
    if fs::read_to_string(&complete).is_ok_and(|complete| complete == packages_in) {
        return Ok(python);
    }
    say!("making a Python environment in {}", folder.display())?;
    run(Command::new("python3").args(["-m", "venv", "--clear"]).arg(&folder))?;
    run(Command::new(&python).args(["-m", "pip", "install", "--quiet"]).args(packages))?;
    fs::write(complete, packages_in)?;
    Ok(python)
}

/// Returns the interpreter of the environment with gymnasium-robotics on a version of MuJoCo.
fn reference_on(mujoco: &str) -> anyhow::Result<PathBuf> {
    if mujoco == MUJOCO {
        return environment("python", &REFERENCE);
    }
    ensure!(
        !mujoco.starts_with("2."),
        "this is built on MuJoCo {mujoco}, which Python packages do not offer: run \
         `cargo xtask mujoco {MUJOCO}`"
    );
    let package = format!("mujoco=={mujoco}");
    let packages = REFERENCE.map(|name| if name.starts_with("mujoco==") { &package } else { name });
    environment(&format!("python-mujoco-{mujoco}"), &packages)
}

/// Runs a script that records the real environment into a folder, with an OpenGL library.
pub fn record(into: &Path, script: &str, arguments: &[&str], gl: &str) -> anyhow::Result<()> {
    let python = reference_on(&MujocoVersion::of_library()?.to_string())?;
    let path = into.join("record.py");
    fs::write(&path, script)?;
    fs::write(into.join("start.py"), START_SCRIPT)?;
    run(Command::new(python)
        .args([&path, Path::new("--out"), into])
        .args(arguments)
        .env("MUJOCO_GL", gl)
        .env("PYTHONWARNINGS", "ignore"))
}

/// Runs a command and waits until it ends.
pub fn run(command: &mut Command) -> anyhow::Result<()> {
    let status = command.status().with_context(|| format!("{command:?} did not start"))?;
    ensure!(status.success(), "{command:?} failed: run this again");
    Ok(())
}
