//! `sanitize`: runs tests under tools that see what a test cannot: misused memory, races, and
//! undefined behavior.

use std::{num::NonZeroU32, process::Command};

use anyhow::ensure;

use crate::tools::{NIGHTLY, cargo, install_toolchain, on_toolchain, succeeds};

/// The target of the build: naming it keeps the flags away from build scripts.
const TARGET: &str = "x86_64-unknown-linux-gnu";

/// Environment variable that names the program that runs tests.
const RUNNER: &str = "CARGO_TARGET_X86_64_UNKNOWN_LINUX_GNU_RUNNER";

/// A check, which returns whether nothing was found in this number of random models.
type Check = fn(cases: u32) -> anyhow::Result<bool>;

const CHECKS: [(&str, Check); 4] =
    [("shim", shim), ("memory", memory), ("threads", threads), ("miri", miri)];

#[derive(clap::Args)]
pub struct Args {
    /// Run only this check: shim (AddressSanitizer and UndefinedBehaviorSanitizer on the C code),
    /// memory (Valgrind), threads (ThreadSanitizer) or miri
    #[arg(long, value_name = "CHECK", value_parser = known_check)]
    only: Option<(&'static str, Check)>,
    /// Number of random models in the check shim; memory uses a tenth
    #[arg(long, default_value = "256")]
    cases: NonZeroU32,
}

fn known_check(name: &str) -> Result<(&'static str, Check), &'static str> {
    let known = CHECKS.into_iter().find(|(known, _)| *known == name);
    known.ok_or("the checks are shim, memory, threads and miri")
}

pub fn run(args: &Args) -> anyhow::Result<bool> {
    for (name, check) in args.only.map_or_else(|| CHECKS.to_vec(), |only| vec![only]) {
        if !check(args.cases.get())? {
            say!("sanitize {name}: failed")?;
            return Ok(false);
        }
        say!("sanitize {name}: nothing found")?;
    }
    Ok(true)
}

/// Runs AddressSanitizer, with its search for leaks, and UndefinedBehaviorSanitizer on the C shim.
fn shim(cases: u32) -> anyhow::Result<bool> {
    let output = Command::new("cc").arg("-print-file-name=libasan.so").output();
    let library = output.ok().and_then(|output| String::from_utf8(output.stdout).ok());
    let library = library.as_deref().map(str::trim).filter(|path| path.contains('/'));
    ensure!(library.is_some(), "there is no AddressSanitizer: apt-get install -y gcc");
    let mut test = cargo();
    test.args(["test", "-p", "fetch-sim", "--target", TARGET])
        .args(["--target-dir", "target/sanitized"])
        .args(["--test", "random_models", "--test", "contact_filter", "--test", "fetch"])
        .args(["--test", "binding", "--test", "refusals", "--test", "user_models"])
        .env("PROPTEST_CASES", cases.to_string())
        .env("CFLAGS", "-fsanitize=address,undefined -fno-sanitize-recover=all -g")
        .env("RUSTFLAGS", "-Clink-arg=-lasan -Clink-arg=-lubsan")
        .env(RUNNER, format!("env LD_PRELOAD={}", library.unwrap_or_default()));
    succeeds(&mut test)
}

/// Runs Valgrind on loading, stepping, failing and dropping simulations.
fn memory(cases: u32) -> anyhow::Result<bool> {
    let is_there = Command::new("valgrind").arg("--version").output().is_ok();
    ensure!(is_there, "there is no Valgrind: apt-get install -y valgrind");
    let valgrind = "valgrind --quiet --error-exitcode=99 --leak-check=full \
                    --show-leak-kinds=definite --errors-for-leak-kinds=definite";
    let mut test = cargo();
    test.args(["test", "-p", "fetch-sim"])
        .args(["--test", "binding", "--test", "random_models", "--", "--test-threads", "1"])
        // Each takes about as long as ten in `shim`.
        .env("PROPTEST_CASES", cases.div_ceil(10).to_string())
        .env(RUNNER, valgrind);
    succeeds(&mut test)
}

/// Runs ThreadSanitizer on the vectorized environments.
fn threads(_: u32) -> anyhow::Result<bool> {
    if !install_toolchain(NIGHTLY, &["rust-src"])? {
        say!("rustup cannot install {NIGHTLY}, so the check for races was skipped")?;
        return Ok(true);
    }
    let mut test = on_toolchain(NIGHTLY, "test");
    test.args(["-p", "fetch-env", "--no-default-features", "--test", "vec_env"])
        .args(["-Zbuild-std", "--target", TARGET, "--target-dir", "target/sanitized-threads"])
        .env("RUSTFLAGS", "-Zsanitizer=thread");
    succeeds(&mut test)
}

/// Runs Miri on the crates without C: it interprets them, and sees all undefined behavior that
/// happens.
fn miri(_: u32) -> anyhow::Result<bool> {
    if !install_toolchain(NIGHTLY, &["miri", "rust-src"])? {
        say!("rustup cannot install {NIGHTLY}, so Miri was skipped")?;
        return Ok(true);
    }
    // It takes a minute for what others do in milliseconds. The random properties of goal-reward
    // are left out: they call what its other tests call.
    let of_rewards = "-p goal-reward --test defaults --test laws --test numpy --test symmetry";
    for tests in [of_rewards, "-p her-relabel --lib"] {
        let mut test = on_toolchain(NIGHTLY, "miri");
        test.arg("test")
            .args(tests.split(' '))
            .env("PROPTEST_CASES", "1")
            .env("MIRIFLAGS", "-Zmiri-disable-isolation");
        if !succeeds(&mut test)? {
            return Ok(false);
        }
    }
    Ok(true)
}
