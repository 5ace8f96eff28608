//! `ci`: what continuous integration runs, cheapest checks first.

use std::process::Command;

use anyhow::Context;
use lexopt::Parser;

use crate::cache_folder;

/// A cargo command and its purpose.
struct Step {
    purpose: &'static str,
    command: &'static str,
    /// The version of MuJoCo in the cache to use; `None` for the default one.
    mujoco: Option<&'static str>,
}

const fn step(purpose: &'static str, command: &'static str) -> Step {
    Step { purpose, command, mujoco: None }
}

const fn step_on_3(purpose: &'static str, command: &'static str) -> Step {
    Step { purpose, command, mujoco: Some("3.6.0") }
}

const STEPS: [Step; 20] = [
    step("formatting", "fmt --all --check"),
    step("lints", "clippy --workspace --all-targets -- -D warnings"),
    step(
        "lints without MuJoCo",
        "clippy -p fetch-sim -p fetch-env -p baselines --no-default-features --all-targets -- -D warnings",
    ),
    step(
        "lints with numpy archives",
        "clippy -p her-relabel --features npz --all-targets -- -D warnings",
    ),
    step(
        "lints without rendering",
        "clippy -p fetch-sim -p fetch-env -p baselines --no-default-features --features mujoco --all-targets -- -D warnings",
    ),
    step("documentation", "doc --workspace --no-deps"),
    step(
        "documentation without MuJoCo",
        "doc -p fetch-sim -p fetch-env -p baselines --no-deps --no-default-features",
    ),
    step("documentation with numpy archives", "doc -p her-relabel --no-deps --features npz"),
    step(
        "tests without MuJoCo",
        "test -p fetch-sim -p fetch-env -p baselines --no-default-features",
    ),
    step("tests", "test --workspace"),
    step("tests with numpy archives", "test -p her-relabel --features npz --lib --test npz"),
    step("fuzzing", "xtask fuzz --seconds 15"),
    step("verify", "xtask verify"),
    step("figures", "xtask figures --out target/figures"),
    step("the reference's model", "xtask assets"),
    step(
        "bit for bit the reference",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-2.2.2 --model reference",
    ),
    step("MuJoCo 3.6.0", "xtask mujoco 3.6.0"),
    step_on_3("tests on MuJoCo 3.6.0", "test -p fetch-sim -p fetch-env --features fetch-env/clip"),
    step_on_3(
        "bit for bit the reference on MuJoCo 3.6.0",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-3.6.0 --model reference",
    ),
    step_on_3("verify on MuJoCo 3.6.0", "xtask verify"),
];

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    if let Some(argument) = arguments.next()? {
        return Err(argument.unexpected().into());
    }
    for Step { purpose, command, mujoco } in STEPS {
        println!("== {purpose}: cargo {command}");
        let mut cargo = Command::new(env!("CARGO"));
        cargo.args(command.split(' ')).env("RUSTDOCFLAGS", "-D warnings");
        if let Some(version) = mujoco {
            cargo.env("MUJOCO_DIR", cache_folder()?.join(format!("mujoco-{version}")));
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
