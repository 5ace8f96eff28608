//! `ci`: what continuous integration runs, cheapest checks first.

use std::process::Command;

use anyhow::Context;
use lexopt::Parser;

use crate::fetch;

/// The purpose of a cargo command, and the command.
type Step = (&'static str, &'static str);

/// Without MuJoCo, as on a machine that has no headers.
const WITHOUT_HEADERS: [Step; 3] = [
    ("lints without MuJoCo's headers", "clippy --workspace --all-targets -- -D warnings"),
    (
        "documentation without MuJoCo's headers",
        "doc -p fetch-sim -p fetch-env -p fetch-baselines --no-deps --features fetch-sim/fetch",
    ),
    ("tests without MuJoCo's headers", "test -p fetch-sim --features fetch"),
];

/// On the system's MuJoCo.
const STEPS: [Step; 29] = [
    ("formatting", "fmt --all --check"),
    ("lints", "clippy --workspace --all-targets -- -D warnings"),
    (
        "lints without MuJoCo",
        "clippy -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features --all-targets -- -D warnings",
    ),
    ("lints with fetching", "clippy -p fetch-sim --features fetch --all-targets -- -D warnings"),
    (
        "lints with fetching alone",
        "clippy -p fetch-sim --no-default-features --features fetch --all-targets -- -D warnings",
    ),
    (
        "lints with numpy archives",
        "clippy -p her-relabel --features npz --all-targets -- -D warnings",
    ),
    (
        "lints without rendering",
        "clippy -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features --features mujoco --all-targets -- -D warnings",
    ),
    (
        "lints of learning without MuJoCo",
        "clippy -p fetch-baselines --no-default-features --features learn --all-targets -- -D warnings",
    ),
    (
        "lints with MPI",
        "clippy -p fetch-baselines -p lab --features lab/mpi --all-targets -- -D warnings",
    ),
    ("documentation", "doc --workspace --no-deps"),
    ("documentation with MPI", "doc -p fetch-baselines --no-deps --features learn,mpi"),
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
    (
        "ranks that share a run, and their faults",
        "test -p lab --features mpi --test mpi -- --test-threads 1",
    ),
    ("tests with numpy archives", "test -p her-relabel --features npz --lib --test npz"),
    ("fuzzing", "xtask fuzz --seconds 15"),
    ("sanitizers, Valgrind and Miri", "xtask sanitize"),
    ("mutants of the last commits", "xtask mutants --commits 10 --at-most 4"),
    ("many steps", "xtask soak --steps 100000"),
    ("verify", "xtask verify"),
    LEARN,
    LEARN_IN_PART,
    ("figures", "xtask figures --out target/figures"),
    ("projects outside the workspace", "xtask projects"),
    ("packages", "xtask packages"),
    ("the reference's model", "xtask assets"),
    (
        "bit for bit the reference",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-2.2.2 --model reference",
    ),
];

/// The tests of everything that uses MuJoCo.
const TESTS: Step =
    ("tests", "test -p fetch-sim -p fetch-env -p fetch-baselines -p lab --features fetch-env/clip");
const VERIFY: Step = ("verify", "xtask verify");
/// Fails if the policy does not succeed in 100 of 100 episodes.
const LEARN: Step = (
    "learning to reach",
    "xtask train --env-id FetchReach-v4 --out target/learn/reach --overwrite",
);
/// A run without a target, which ends before it has learned the task.
const LEARN_IN_PART: Step = (
    "learning to push, in part",
    "xtask train --env-id FetchPush-v4 --steps 12000 --target 2 --set random_episodes=40 --out target/learn/push --overwrite",
);
const LIVE: Step = ("bit for bit the reference in Python", "xtask parity --live");

const ON_3_6: [Step; 5] = [
    TESTS,
    (
        "bit for bit the reference",
        "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-3.6.0 --model reference",
    ),
    VERIFY,
    LEARN,
    LEARN_IN_PART,
];

/// The values of `MUJOCO_DIR` (a version stands for its folder in the cache), and the steps with each.
const ALL: [(Option<&str>, &[Step]); 6] = [
    (None, &STEPS),
    (Some("none"), &WITHOUT_HEADERS),
    (Some("3.6.0"), &ON_3_6),
    // The newest release.
    (Some("4.0.1"), &[TESTS, VERIFY]),
    // The newest that gymnasium-robotics can start on unaided, and the newest that it can start on.
    (Some("3.11.0"), &[LIVE]),
    (Some("4.0.0"), &[LIVE]),
];

pub fn run(mut arguments: Parser) -> anyhow::Result<bool> {
    if let Some(argument) = arguments.next()? {
        return Err(argument.unexpected().into());
    }
    for (mujoco, steps) in ALL {
        let mujoco_dir = match mujoco {
            None | Some("none") => mujoco.map(Into::into),
            Some(version) => Some(fetch::mujoco(version)?),
        };
        for (purpose, command) in steps {
            let on = mujoco.map_or_else(String::new, |mujoco| format!(" (MuJoCo {mujoco})"));
            say!("== {purpose}{on}: cargo {command}")?;
            let mut cargo = Command::new(env!("CARGO"));
            cargo.args(command.split(' ')).env("RUSTDOCFLAGS", "-D warnings");
            if let Some(dir) = &mujoco_dir {
                cargo.env("MUJOCO_DIR", dir);
            }
            let status =
                cargo.status().with_context(|| format!("cargo {command} did not start"))?;
            if !status.success() {
                say!("== {purpose}{on}: failed")?;
                return Ok(false);
            }
        }
    }
    say!("== all passed")?;
    Ok(true)
}
