//! `platforms`: builds and tests the crates for systems and processors other than this machine's.

mod aarch64_linux;
mod aarch64_macos;
pub(crate) mod x86_64_windows;

use std::path::Path;

use crate::tools::{ROOT, cargo, install_target, succeeds};

/// A platform, under the name that `cargo xtask mujoco --for` also takes.
#[derive(Clone, Copy)]
struct Platform {
    name: &'static str,
    target: &'static str,
    /// Returns whether everything passed.
    check: fn() -> anyhow::Result<bool>,
}

const PLATFORMS: [Platform; 3] =
    [aarch64_linux::PLATFORM, aarch64_macos::PLATFORM, x86_64_windows::PLATFORM];

#[derive(clap::Args)]
pub struct Args {
    /// Only this platform: aarch64-linux (tests in QEMU), aarch64-macos (compiles and links) or
    /// x86_64-windows (tests in Wine)
    #[arg(long, value_parser = known_platform)]
    only: Option<Platform>,
}

fn known_platform(name: &str) -> Result<Platform, String> {
    let known = PLATFORMS.into_iter().find(|platform| platform.name == name);
    known.ok_or_else(|| {
        format!("the platforms are {}", PLATFORMS.map(|platform| platform.name).join(", "))
    })
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    for Platform { name, target, check } in args.only.map_or(PLATFORMS.to_vec(), |only| vec![only])
    {
        if !install_target(target) {
            say!("platforms: {name}: skipped, because rustup cannot install {target}")?;
        } else if !check()? {
            say!("platforms: {name}: failed")?;
            return Ok(false);
        }
    }
    Ok(true)
}

/// Runs a cargo command for a target, with environment variables that may name tools for it, and
/// returns whether it succeeded.
fn cargo_for(
    target: &str,
    arguments: &str,
    mujoco: &Path,
    variables: &[(&str, &str)],
) -> anyhow::Result<bool> {
    say!("platforms: cargo {arguments}")?;
    let (command, arguments) = arguments.split_once(' ').unwrap_or((arguments, ""));
    let mut cargo = cargo();
    cargo
        .args([command, "--target", target])
        .args(arguments.split_whitespace())
        .envs(variables.iter().copied())
        // A separate folder, so that builds for this machine need not wait.
        .env("CARGO_TARGET_DIR", Path::new(ROOT).join("target/platforms"))
        .env("MUJOCO_DIR", mujoco);
    succeeds(&mut cargo)
}

/// Checks that all crates compile without MuJoCo.
fn compile_without_mujoco(target: &str) -> anyhow::Result<bool> {
    let arguments = "check -p goal-reward -p her-relabel -p fetch-sim -p fetch-env \
        -p fetch-baselines --features fetch-sim/download,fetch-env/clip,fetch-baselines/learn,\
        fetch-baselines/page";
    cargo_for(target, arguments, Path::new("none"), &[("RUSTFLAGS", "-D warnings")])
}
