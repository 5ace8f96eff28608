//! `ci`: what continuous integration runs, cheapest checks first.

use std::process::Command;

use anyhow::Context;
use lexopt::Parser;

use crate::cache_folder;

/// The purpose of each cargo command, and the command.
const STEPS: [(&str, &str); 18] = [
    ("formatting", "fmt --all --check"),
    ("lints", "clippy --workspace --all-targets -- -D warnings"),
    (
        "lints without MuJoCo",
        "clippy -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features --all-targets -- -D warnings",
    ),
    (
        "lints with numpy archives",
        "clippy -p her-relabel --features npz --all-targets -- -D warnings",
    ),
    (
        "lints without rendering",
        "clippy -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features --features mujoco --all-targets -- -D warnings",
    ),
    ("documentation", "doc --workspace --no-deps"),
    (
        "documentation without MuJoCo",
        "doc -p fetch-sim -p fetch-env -p fetch-baselines --no-deps --no-default-features",
    ),
    ("documentation with numpy archives", "doc -p her-relabel --no-deps --features npz"),
    (
        "tests without MuJoCo",
        "test -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features",
    ),
    ("tests", "test --workspace"),
    ("tests with numpy archives", "test -p her-relabel --features npz --lib --test npz"),
    ("fuzzing", "xtask fuzz --seconds 15"),
    ("verify", "xtask verify"),
    ("figures", "xtask figures --out target/figures"),
    ("packages", "publish --workspace --dry-run --quiet --allow-dirty"),
    ("the reference's model", "xtask assets"),
    (
        "bit for bit the reference",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-2.2.2 --model reference",
    ),
    ("MuJoCo 3.6.0", "xtask mujoco 3.6.0"),
];

/// The same, run on MuJoCo 3.6.0 from the cache.
const STEPS_ON_3: [(&str, &str); 3] = [
    ("tests on MuJoCo 3.6.0", "test -p fetch-sim -p fetch-env --features fetch-env/clip"),
    (
        "bit for bit the reference on MuJoCo 3.6.0",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-3.6.0 --model reference",
    ),
    ("verify on MuJoCo 3.6.0", "xtask verify"),
];

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    if let Some(argument) = arguments.next()? {
        return Err(argument.unexpected().into());
    }
    let on_3 = cache_folder()?.join("mujoco-3.6.0");
    let steps = STEPS.map(|step| (step, None)).into_iter();
    for ((purpose, command), mujoco) in steps.chain(STEPS_ON_3.map(|step| (step, Some(&on_3)))) {
        println!("== {purpose}: cargo {command}");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(command.split(' ')).env("RUSTDOCFLAGS", "-D warnings");
        if let Some(folder) = mujoco {
            cargo.env("MUJOCO_DIR", folder);
        }
        let status = cargo.status().with_context(|| format!("cargo {command} did not start"))?;
        if !status.success() {
            println!("== {purpose}: failed");
            return Ok(false);
        }
    }
    println!("== all passed");
    Ok(true)
}
