//! The tools and toolchains that commands run, and where they are.

use std::{
    env,
    path::{Path, PathBuf},
    process::Command,
};

use anyhow::{Context, ensure};

/// Folder of the workspace.
pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A toolchain for what stable Rust lacks. A later one may write a documentation format that the
/// tool that compares interfaces cannot read.
pub const NIGHTLY: &str = "nightly-2026-05-20";

/// The MuJoCo of the Python package, and of what is built for other platforms.
pub const MUJOCO: &str = "3.6.0";

/// PyPI's package of Zig, whose C compiler has the headers of other systems.
pub const ZIG: &str = "ziglang==0.17.1";

/// Returns the path of a tool, which is built on first use.
pub fn tool((name, version): (&str, &str)) -> anyhow::Result<PathBuf> {
    let folder = Path::new(ROOT).join("target/tools").join(format!("{name}-{version}"));
    let program = folder.join("bin").join(name);
    if !program.exists() {
        let mut install = cargo();
        install.args(["install", name, "--version", version, "--locked", "--debug", "--quiet"]);
        ensure!(
            succeeds(install.arg("--root").arg(&folder))?,
            "{name} {version} could not be installed"
        );
    }
    Ok(program)
}

/// Installs a toolchain with components unless rustup has them, and returns whether it has.
pub fn install_toolchain(toolchain: &str, components: &[&str]) -> anyhow::Result<bool> {
    let mut list = Command::new("rustup");
    list.args(["component", "list", "--installed", "--toolchain", toolchain]);
    let has = list.output().is_ok_and(|listed| {
        let lines = String::from_utf8_lossy(&listed.stdout);
        let has = |component: &&str| lines.lines().any(|line| line.starts_with(component));
        listed.status.success() && components.iter().all(has)
    });
    let mut install = Command::new("rustup");
    install.args(["toolchain", "install", toolchain, "--profile", "minimal"]);
    for component in components {
        install.args(["--component", component]);
    }
    Ok(has || install.status().is_ok_and(|status| status.success()))
}

/// Installs a target's standard library unless rustup has it, and returns whether it has.
pub fn install_target(target: &str) -> bool {
    let mut list = Command::new("rustup");
    list.args(["target", "list", "--installed"]);
    let has = list.output().is_ok_and(|listed| {
        String::from_utf8_lossy(&listed.stdout).lines().any(|line| line == target)
    });
    let mut install = Command::new("rustup");
    install.args(["target", "add", target]);
    has || install.status().is_ok_and(|status| status.success())
}

/// Returns a cargo command that runs on another toolchain.
pub fn on_toolchain(toolchain: &str, command: &str) -> Command {
    let mut cargo = Command::new("rustup");
    cargo.args(["run", toolchain, "cargo", command]).current_dir(ROOT);
    // Cargo sets it for this process, to its own toolchain.
    cargo.env_remove("RUSTUP_TOOLCHAIN");
    cargo
}

/// Returns a cargo command that runs in the workspace.
pub fn cargo() -> Command {
    let mut cargo = Command::new(env!("CARGO"));
    cargo.current_dir(ROOT);
    cargo
}

/// Runs a command, and returns whether it succeeded.
pub fn succeeds(command: &mut Command) -> anyhow::Result<bool> {
    Ok(command.status().with_context(|| format!("{command:?} did not start"))?.success())
}
