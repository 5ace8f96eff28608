//! The steps of `test` and `ci`.
//!
//! Most name the whole workspace, so that they share what is built: a crate gets all the features
//! that the chosen packages ask for.

use super::needs::Need::{
    self, Aarch64, CPlusPlus, Chromium, Clippy, Git, Hosts, Mpi, Mujoco, OpenGl, Python, Rustfmt,
    Valgrind, Wine,
};

/// A part of the work that passes or fails.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    pub purpose: &'static str,
    /// A command of cargo.
    pub command: &'static str,
    /// What it needs beyond Rust and the MuJoCo that it runs on.
    pub needs: &'static [Need],
}

const fn step(purpose: &'static str, command: &'static str, needs: &'static [Need]) -> Step {
    Step { purpose, command, needs }
}

/// Steps that run on a MuJoCo.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// The value of `MUJOCO_DIR`, where a version stands for its folder in the cache; `None` leaves
    /// it as it is, so that the steps run on the MuJoCo that any build takes.
    pub mujoco: Option<&'static str>,
    /// What all of the steps need.
    pub needs: &'static [Need],
    pub steps: &'static [Step],
}

/// All tests that need no more than the README's first command, with the default features: `test`
/// runs them, and `ci` runs them first.
pub const TESTS: Stage =
    Stage { mujoco: None, needs: &[Mujoco], steps: &[step("tests", "test --workspace", &[])] };

/// The other steps that run on the system's MuJoCo and share what is built, cheapest first.
const ON_SYSTEM: Stage = Stage {
    mujoco: None,
    needs: &[Mujoco],
    steps: &[
        step("formatting", "fmt --all --check", &[Rustfmt]),
        step(
            "formatting of the Python package's Rust code",
            "fmt --manifest-path fetch-env/python/Cargo.toml --check",
            &[Rustfmt],
        ),
        // What is built with MPI; "lints without MuJoCo's headers" has what is built without it.
        step(
            "lints",
            "clippy --workspace --features \
             fetch-sim/download,her-relabel/npz,fetch-cli/mpi,lab/product --all-targets -- -D warnings",
            &[Clippy, Mpi],
        ),
        step(
            "lints of the Python package's Rust code",
            "clippy --manifest-path fetch-env/python/Cargo.toml --target-dir target -- -D warnings",
            &[Clippy, Python],
        ),
        step(
            "lints without MuJoCo",
            "clippy -p fetch-install -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features \
             --features fetch-baselines/learn --all-targets -- -D warnings",
            &[Clippy],
        ),
        step(
            "lints without rendering",
            "clippy -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features \
             --features mujoco --all-targets -- -D warnings",
            &[Clippy],
        ),
        step(
            "lints of the program's quick commands",
            "clippy -p fetch-cli --no-default-features --all-targets -- -D warnings",
            &[Clippy],
        ),
        step(
            "tests without MuJoCo",
            "test -p fetch-sim -p fetch-env -p fetch-baselines --no-default-features",
            &[],
        ),
        step(
            "documentation",
            "doc --workspace --no-deps --features her-relabel/npz,fetch-cli/mpi",
            &[Mpi],
        ),
        step("pictures of the commands", "test --workspace --test commands pictures", &[OpenGl]),
        // The report, which takes most of a minute, is looked at by "tests" if Chromium is there.
        step(
            "a page in Chromium",
            "test --workspace --test page an_episode_is_played_back",
            &[Chromium],
        ),
        step(
            "ranks that share a run, and their faults",
            "test --workspace --features fetch-cli/mpi --test mpi -- --test-threads 1",
            &[Mpi, Hosts],
        ),
        step("sanitizers on the C code", "xtask sanitize --only shim --cases 64", &[]),
        step("Valgrind", "xtask sanitize --only memory --cases 64", &[Valgrind]),
        VERIFY,
        step("the reference's model", "xtask assets", &[Python]),
        // Uses what `test` has built.
        step(
            "bit parity with the reference",
            "test --workspace --test commands where_the_reference_model_is",
            &[Python],
        ),
    ],
};

/// Steps that build in their own folders, and so can run beside the others on the system's MuJoCo.
pub const BESIDE: Stage = Stage {
    mujoco: None,
    needs: &[Mujoco],
    steps: &[
        step(
            "projects outside the workspace",
            "xtask projects --exclude burn --exclude candle",
            &[Rustfmt],
        ),
        step("the Python package", "xtask python", &[Python, OpenGl]),
        step("Linux on ARM", "xtask platforms --only aarch64-linux", &[Aarch64, Python]),
        step("macOS", "xtask platforms --only aarch64-macos", &[Python]),
        step("Windows", "xtask platforms --only x86_64-windows", &[Python, Wine]),
    ],
};

/// Without MuJoCo, as on a machine that has no headers.
const WITHOUT_HEADERS: Stage = Stage {
    mujoco: Some("none"),
    needs: &[],
    steps: &[
        step(
            "lints without MuJoCo's headers",
            "clippy --workspace --all-targets -- -D warnings",
            &[Clippy],
        ),
        step(
            "documentation without MuJoCo's headers",
            "doc -p fetch-sim -p fetch-env -p fetch-baselines --no-deps --features \
             fetch-sim/download",
            &[],
        ),
        step("tests without MuJoCo's headers", "test -p fetch-sim --features download", &[]),
    ],
};

/// The longest steps, which `ci --all` also runs, before a release.
pub const LONGEST: [Stage; 3] = [
    LONGEST_ON_SYSTEM,
    on("3.6.0", &[step("tests of policies", "test -p fetch-baselines", &[OpenGl])]),
    on(
        "4.0.1",
        &[
            step(
                "tests of the environments",
                "test -p fetch-env --features fetch-env/clip",
                &[OpenGl],
            ),
            VERIFY,
        ],
    ),
];

const LONGEST_ON_SYSTEM: Stage = Stage {
    mujoco: None,
    needs: &[Mujoco],
    steps: &[
        step(
            "documentation without MuJoCo",
            "doc -p fetch-sim -p fetch-env -p fetch-baselines --no-deps --no-default-features",
            &[],
        ),
        step("fuzzing", "xtask fuzz", &[CPlusPlus]),
        step("ThreadSanitizer", "xtask sanitize --only threads", &[]),
        step("Miri", "xtask sanitize --only miri", &[]),
        step("mutants of the last commits", "xtask mutants --commits 3 --at-most 1", &[Git]),
        step("many steps", "xtask soak", &[OpenGl]),
        step("packages", "xtask packages --build", &[Clippy, Mpi]),
        step("wheels for all platforms", "xtask wheels", &[Python, Wine]),
        step("a project with burn", "xtask projects --only burn", &[Rustfmt]),
        step("a project with candle", "xtask projects --only candle", &[Rustfmt]),
    ],
};

const VERIFY: Step = step("verify", "xtask verify", &[]);

const fn on(version: &'static str, steps: &'static [Step]) -> Stage {
    // Python's pip fetches it.
    Stage { mujoco: Some(version), needs: &[Python], steps }
}

/// What `ci` runs after [`TESTS`], with [`BESIDE`] beside both.
pub const FIRST: [Stage; 4] = [ON_SYSTEM, WITHOUT_HEADERS, ON_PYTHONS, ON_NEWEST];

/// On the version that the Python package brings.
const ON_PYTHONS: Stage = on(
    "3.6.0",
    &[
        // Tests of what a version of MuJoCo can change.
        step("tests of the environments", "test -p fetch-sim -p fetch-env", &[OpenGl]),
        step(
            "bit parity with the reference",
            "xtask parity --fixtures xtask/lab/tests/recordings/mujoco-3.6.0 --model reference",
            &[],
        ),
        // With the program that the next commands need, instead of `xtask verify`'s.
        step("verify", "run --quiet --release -p fetch-cli -- verify", &[]),
        // Fails if the policy does not succeed in 100 of 100 episodes.
        step(
            "learning to reach",
            "xtask train --env-id FetchReach-v4 --set evaluation_episodes=100 --out target/learn/reach \
                 --overwrite",
            &[],
        ),
        // A run without a target, which ends before it has learned the task.
        step(
            "learning to push, in part",
            "xtask train --env-id FetchPush-v4 --steps 8000 --target 2 \
                 --set random_episodes=40 --out target/learn/push --overwrite",
            &[],
        ),
        step("figures", "xtask figures --out target/figures", &[OpenGl]),
        step("bit parity with the reference in Python", "xtask parity live", &[]),
    ],
);

/// On the newest release.
const ON_NEWEST: Stage =
    on("4.0.1", &[step("tests of simulations", "test -p fetch-sim", &[OpenGl])]);

/// What `ci` runs after all of these, because it uses the folders of "the Python package".
pub const LAST: Stage =
    on("3.6.0", &[step("data sets", "xtask python --sets 500", &[Python, OpenGl])]);

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn all() -> impl Iterator<Item = (Stage, Step)> {
        let stages = [&[TESTS, BESIDE][..], &FIRST, &[LAST], &LONGEST].concat();
        stages.into_iter().flat_map(|stage| stage.steps.iter().map(move |step| (stage, *step)))
    }

    #[test]
    fn every_step_names_what_its_command_needs() {
        let of_words = [
            ("fmt", Rustfmt),
            ("clippy", Clippy),
            ("fetch-cli/mpi", Mpi),
            ("learn,mpi", Mpi),
            ("render", OpenGl),
            ("figures", OpenGl),
            ("soak", OpenGl),
            ("page", Chromium),
            ("fuzz", CPlusPlus),
            ("memory", Valgrind),
            ("mutants", Git),
            ("packages", Clippy),
            ("packages", Mpi),
            ("projects", Rustfmt),
            ("python", Python),
            ("python", OpenGl),
            ("assets", Python),
            ("reference", Python),
            ("live", Python),
            ("aarch64-linux", Aarch64),
            ("aarch64-linux", Python),
            ("aarch64-macos", Python),
            ("x86_64-windows", Python),
            ("x86_64-windows", Wine),
            ("wheels", Python),
            ("wheels", Wine),
        ];
        for (stage, step) in all() {
            let has = |need| stage.needs.contains(&need) || step.needs.contains(&need);
            for word in step.command.split_whitespace() {
                for (_, need) in of_words.iter().filter(|(known, _)| *known == word) {
                    assert!(has(*need), "{}: {word} needs {}", step.purpose, need.name());
                }
            }
            assert!(stage.mujoco.is_some() || has(Mujoco), "{}", step.purpose);
        }
    }

    #[test]
    fn everything_that_is_looked_for_is_needed() {
        for need in Need::ALL {
            let is_named = |(stage, step): (Stage, Step)| {
                stage.needs.contains(&need) || step.needs.contains(&need)
            };
            assert!(all().any(is_named), "{}", need.name());
        }
    }

    #[test]
    fn the_tests_of_a_newcomer_need_mujoco_alone() {
        assert_eq!(TESTS.needs, [Mujoco]);
        assert!(TESTS.steps.iter().all(|step| step.needs.is_empty()));
    }

    #[test]
    fn no_step_runs_twice() {
        let mut known = BTreeSet::new();
        for (stage, step) in all() {
            assert!(known.insert((stage.mujoco, step.command)), "{}", step.command);
        }
    }
}
