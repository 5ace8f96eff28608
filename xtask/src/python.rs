//! `python`: builds the Python package as its users would, and tests it beside the reference.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};
use fetch_install::download;

use crate::{
    package_build::{BUILDERS, FOLDER, build, environment, pip_install},
    tools::{MUJOCO, ROOT, cargo, succeeds},
};

/// The packages that test it and write its pages, with fixed versions so that CI does not change by
/// itself, and the reference.
const TESTERS: [&str; 11] = [
    "furo==2025.12.19",
    "gymnasium-robotics==1.4.2",
    "gymnasium==1.4.0",
    "minari==0.5.4",
    "mypy==2.4.1",
    "pillow==13.0.0",
    "pyarrow==26.0.1",
    PYTEST,
    "ruff==0.17.6",
    "sphinx==9.0.4",
    "tqdm==4.70.1",
];
const PYTEST: &str = "pytest==9.2.0";
/// OGBench's loader, without the packages that only its environments need.
const OGBENCH: &str = "ogbench==1.2.2";
/// The packages that the tests of Stable-Baselines3 and of exports need; they install torch.
const STABLE_BASELINES3: [&str; 4] =
    ["onnx==1.23.2", "onnxruntime==1.32.0", "stable-baselines3==2.9.2", "tensorboard==2.21.0"];
/// The package that the tests of LeRobot need; it installs torch, too.
const LEROBOT: [&str; 1] = ["lerobot==0.4.4"];
/// Libraries of others, each with what its tests need. They do not agree on versions.
const LIBRARIES: [(&str, &[&str]); 4] = [
    ("torchrl", &["torchrl==0.14.1", "gymnasium==1.4.0"]),
    ("skrl", &["skrl==2.1.1", "gymnasium==1.4.0"]),
    ("tianshou", &["tianshou==2.0.1", "gymnasium==1.4.0"]),
    ("rllib", &["ray[rllib]==2.60.0", "torch==2.15.0"]),
];

#[derive(clap::Args)]
pub struct Args {
    /// Test the parts for Stable-Baselines3, torch, ONNX and TensorBoard instead, which installs them
    #[arg(long, conflicts_with_all = ["lerobot", "libraries", "sets", "their_tests"])]
    sb3: bool,
    /// Test the parts for LeRobot instead, which installs torch
    #[arg(long, conflicts_with_all = ["libraries", "sets", "their_tests"])]
    lerobot: bool,
    /// Test with TorchRL, skrl, tianshou and RLlib instead, which installs torch for each
    #[arg(long, conflicts_with_all = ["sets", "their_tests"])]
    libraries: bool,
    /// Instead, write all data sets with this many steps each, and read them with the loaders of
    /// Minari and OGBench
    #[arg(long, value_name = "STEPS", conflicts_with = "their_tests")]
    sets: Option<String>,
    /// Run the tests of this checkout of Gymnasium 1.4.0 or gymnasium-robotics 1.4.2 on these
    /// environments instead
    #[arg(long, value_name = "FOLDER")]
    their_tests: Option<PathBuf>,
}

/// The tests to run on the package.
enum Tests<'a> {
    /// Its own tests and pages, Ruff and mypy.
    Own,
    /// The tests of its parts for Stable-Baselines3, torch, ONNX and TensorBoard.
    StableBaselines3,
    /// The tests of its parts for LeRobot.
    LeRobot,
    /// The tests with each of [`LIBRARIES`].
    Libraries,
    /// The tests of a checkout.
    Theirs(&'a Path),
    /// The tests of the data sets that `datasets` writes, with this many steps each.
    Sets(&'a str),
}

impl<'a> Tests<'a> {
    fn new(args: &'a Args) -> Self {
        match (&args.sets, &args.their_tests) {
            _ if args.sb3 => Self::StableBaselines3,
            _ if args.lerobot => Self::LeRobot,
            _ if args.libraries => Self::Libraries,
            (Some(steps), _) => Self::Sets(steps),
            (_, Some(checkout)) => Self::Theirs(checkout),
            (None, None) => Self::Own,
        }
    }

    /// Returns the packages that they need and that install torch.
    const fn heavy_packages(&self) -> &[&'static str] {
        match self {
            Self::StableBaselines3 => &STABLE_BASELINES3,
            Self::LeRobot => &LEROBOT,
            Self::Own | Self::Libraries | Self::Theirs(_) | Self::Sets(_) => &[],
        }
    }
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    let tests = Tests::new(args);
    let root = fs::canonicalize(ROOT)?;
    let folder = root.join(FOLDER);
    let mut packages = [&BUILDERS[..], &TESTERS].concat();
    packages.extend(tests.heavy_packages());
    let python = environment(&root.join("target/python-environment"), &packages, &[OGBENCH])?;
    let wheels = tempfile::tempdir()?;
    say!("python: building the wheel")?;
    let wheel = build(&python, None, wheels.path())?;
    install(&python, &wheel)?;
    let check_with = |python: &Path, arguments: &[&str]| {
        say!("python: {}", arguments.join(" "))?;
        let mut command = Command::new(python);
        command.arg("-m").args(arguments).current_dir(&folder);
        command.env("FETCH_ENV_WHEEL", &wheel);
        anyhow::Ok(command)
    };
    let check = |arguments: &[&str]| check_with(&python, arguments);
    match tests {
        Tests::Libraries => {
            for (name, packages) in LIBRARIES {
                let folder = root.join(format!("target/python-environment-{name}"));
                let python = environment(&folder, &[packages, &[PYTEST]].concat(), &[])?;
                install(&python, &wheel)?;
                let file = format!("tests/libraries/test_{name}.py");
                // Their own warnings are not ours to mend.
                let arguments = ["pytest", "--quiet", "--override-ini=filterwarnings=", &file];
                if !succeeds(&mut check_with(&python, &arguments)?)? {
                    return Ok(false);
                }
            }
            Ok(true)
        }
        Tests::Theirs(checkout) => {
            let mut command =
                check(&["pytest", "-p", "theirs", "--quiet", "--tb", "short", "-rxs"])?;
            succeeds(command.env("PYTHONPATH", folder.join("tests")).current_dir(checkout))
        }
        Tests::Sets(steps) => {
            let sets = tempfile::tempdir()?;
            write_sets(steps, sets.path())?;
            let mut command = check(&["pytest", "--quiet", "-rs", "tests/sets"])?;
            succeeds(command.env("FETCH_ENV_SETS", sets.path()))
        }
        Tests::StableBaselines3 => succeeds(&mut check(&["pytest", "--quiet", "tests/sb3"])?),
        Tests::LeRobot => {
            let mut command = check(&["pytest", "--quiet", "tests/lerobot"])?;
            // LeRobot copies what it reads into a cache, which must not be the user's.
            let cache = tempfile::tempdir()?;
            command.env("HF_HOME", cache.path()).env("HF_HUB_OFFLINE", "1");
            succeeds(&mut command)
        }
        Tests::Own => {
            let pages = root.join("target/python-docs");
            let pages = pages.to_str().context("the path of the checkout is not UTF-8")?;
            let checks: [&[&str]; 5] = [
                &["ruff", "format", "--check", "."],
                &["ruff", "check", "."],
                &["mypy"],
                &["sphinx", "--quiet", "--fail-on-warning", "--fresh-env", "docs", pages],
                &["pytest", "--quiet", "tests"],
            ];
            for arguments in checks {
                let mut command = check(arguments)?;
                // With AVX-512, numpy uses its own arctangent instead of the C library's.
                if !succeeds(command.env("NPY_DISABLE_CPU_FEATURES", "X86_V4"))? {
                    say!("python: {} failed", arguments[0])?;
                    return Ok(false);
                }
            }
            Ok(true)
        }
    }
}

/// Writes all data sets, with the MuJoCo of the package.
fn write_sets(steps: &str, folder: &Path) -> anyhow::Result<()> {
    say!("python: writing data sets")?;
    let mut write = cargo();
    write.args(["run", "--quiet", "--release", "--package", "fetch-cli", "--", "datasets"]);
    write.args(["--steps", steps, "--out"]).arg(folder);
    write.env("MUJOCO_DIR", download::mujoco(MUJOCO)?);
    ensure!(succeeds(&mut write)?, "the data sets cannot be written");
    Ok(())
}

/// Installs the wheel in place of one before.
fn install(python: &Path, wheel: &Path) -> anyhow::Result<()> {
    let path = wheel.to_str().context("the wheel's path is not UTF-8")?;
    pip_install(python, &["--no-deps", "--force-reinstall", path])
}
