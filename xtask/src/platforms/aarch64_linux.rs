//! Linux on ARM servers: the tests run under QEMU's emulation, at a tenth of the machine's speed.

use std::{path::Path, process::Command};

use super::MUJOCO;
use crate::{
    download,
    tools::{cargo, install_target, succeeds},
};

const TARGET: &str = "aarch64-unknown-linux-gnu";

/// Programs by these names, of Debian's packages.
const LINKER: &str = "aarch64-linux-gnu-gcc";
const EMULATOR: &str = "qemu-aarch64 -L /usr/aarch64-linux-gnu";

/// Tests that take seconds, and start no process: the emulated kernel could not run it.
const TESTS: &str = "--test laws --test oracle --test properties --test numpy --test defaults \
    --test binding --test contact_filter --test fetch --test random_models --test refusals \
    --test visual_geoms --test choices --test spaces --test registry --test time_limit \
    --test wrappers --test bad_states --test own_ids --example first_steps --example replay_buffer";

/// The laws of the environments that take the longest: `verify` makes most of these checks, too.
const CONFORMANCE: &str = "--test conformance -- --skip the_checker_finds_nothing";

pub(super) fn check() -> anyhow::Result<bool> {
    if !install_target(TARGET) {
        say!("rustup cannot install {TARGET}, so nothing was run for it")?;
        return Ok(true);
    }
    let mujoco = download::mujoco_for(MUJOCO, "aarch64-linux")?;
    let crates = "-p goal-reward -p her-relabel -p fetch-sim -p fetch-env";
    for arguments in [
        format!("test {crates} {TESTS}"),
        format!("test {crates} {CONFORMANCE}"),
        "run -p chapter -- verify --env-id FetchReach-v4".into(),
    ] {
        say!("platforms: cargo {arguments}")?;
        if !succeeds(&mut on_target(&arguments, &mujoco))? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Returns a command of cargo for this target.
fn on_target(arguments: &str, mujoco: &Path) -> Command {
    let (command, arguments) = arguments.split_once(' ').unwrap_or((arguments, ""));
    let mut cargo = cargo();
    cargo
        .args([command, "--target", TARGET])
        .args(arguments.split_whitespace())
        .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER", LINKER)
        .env("CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER", EMULATOR)
        .env("MUJOCO_DIR", mujoco);
    cargo
}
