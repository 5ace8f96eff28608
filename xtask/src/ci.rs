//! `ci`: what continuous integration runs, cheapest checks first.

use std::process::Command;

use anyhow::Context;

#[derive(clap::Args)]
pub struct Args {}

/// A command line, and what it is for.
const STEPS: [(&str, &str); 9] = [
    ("formatting", "fmt --all --check"),
    ("lints", "clippy --workspace --all-targets -- -D warnings"),
    (
        "lints without MuJoCo",
        "clippy -p fetch-sim -p fetch-env -p baselines --no-default-features --all-targets -- -D warnings",
    ),
    ("documentation", "doc --workspace --no-deps"),
    (
        "documentation without MuJoCo",
        "doc -p fetch-sim -p fetch-env -p baselines --no-deps --no-default-features",
    ),
    ("tests without MuJoCo", "test -p fetch-sim -p fetch-env -p baselines --no-default-features"),
    ("tests", "test --workspace"),
    ("verify", "xtask verify"),
    ("bridge", "xtask bridge"),
];

pub fn run(_args: &Args) -> anyhow::Result<bool> {
    for (purpose, command) in STEPS {
        println!("== {purpose}: cargo {command}");
        let status = Command::new(env!("CARGO"))
            .args(command.split(' '))
            .env("RUSTDOCFLAGS", "-D warnings")
            .status()
            .with_context(|| format!("cargo {command} did not start"))?;
        if !status.success() {
            println!("== {purpose}: failed");
            return Ok(false);
        }
    }
    println!("== all passed");
    Ok(true)
}
