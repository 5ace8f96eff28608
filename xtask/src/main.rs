//! The workspace's task runner: `cargo xtask <command>`.
//!
//! It builds within seconds on a bare machine, without MuJoCo and without a C compiler, so that it
//! can fetch MuJoCo or say that it is missing. It hands commands that step environments on to the
//! packages `chapter` and `lab`.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use(say)]
extern crate commands;

mod ci;
mod downloads;
mod fuzz;
mod mutants;
mod packages;
mod platforms;
mod projects;
mod python;
mod sanitize;
mod tools;

use std::{
    ffi::OsString,
    process::{Command, ExitCode},
};

use anyhow::{Context, ensure};
use commands::{COMMANDS, Listed, Program};
use fetch_install::Places;

/// The commands that xtask runs itself.
const OWN: [commands::Command; 11] = [
    commands::Command {
        name: "assets",
        usage: "[--from <WHEEL>]

  --from <WHEEL>  Use this wheel of gymnasium-robotics 1.4.2 instead of downloading it",
        run: downloads::assets,
    },
    commands::Command {
        name: "mujoco",
        usage: "[--from <WHEEL> | --for <PLATFORM>] <VERSION>

  <VERSION>         The version, such as 3.6.0
  --from <WHEEL>    Use this wheel of that version instead of downloading it
  --for <PLATFORM>  Download it for programs of another system or processor, such as aarch64-linux",
        run: downloads::other_mujoco,
    },
    commands::Command {
        name: "fuzz",
        usage: "[--seconds <N>] [--target <TARGET>]

  --seconds <N>      Run each target this long [default: 15]
  --target <TARGET>  Run only this target: load, npz, ogbench or operations of the buffer, values or
                     calls of environments, settings, checkpoints or minari of training",
        run: fuzz::run,
    },
    commands::Command {
        name: "sanitize",
        usage: "[--only <CHECK>] [--cases <N>]

  --only <CHECK>  Run only this check: shim (AddressSanitizer and UndefinedBehaviorSanitizer on the
                  C code), memory (Valgrind), threads (ThreadSanitizer) or miri
  --cases <N>     Number of random models in the check shim; memory uses a tenth [default: 256]",
        run: sanitize::run,
    },
    commands::Command {
        name: "mutants",
        usage: "[--crate <CRATE>] [--shard <K/N>] [--commits <N>] [--at-most <N>]

  --crate <CRATE>  Only this crate: goal-reward, her-relabel, fetch-baselines, fetch-env or
                   statistics
  --shard <K/N>    Only part K of N, counted from 0
  --commits <N>    Only what the last N commits changed
  --at-most <N>    At most N mutants of each crate, spread over the code",
        run: mutants::run,
    },
    commands::Command {
        name: "packages",
        usage: "[--bless] [--build]

  --bless  Write the public interface to each crate's public-api.txt instead of comparing it
  --build  Also build the crates from their packages",
        run: packages::run,
    },
    commands::Command {
        name: "platforms",
        usage: "[--only <PLATFORM>]

  --only <PLATFORM>  Only this platform: aarch64-linux (tests in QEMU), aarch64-macos (compiles and
                     links) or x86_64-windows (tests in Wine)",
        run: platforms::run,
    },
    commands::Command {
        name: "projects",
        usage: "[--only <PROJECT>] [--exclude <PROJECT>]...

  --only <PROJECT>     Test only this folder of fetch-env/projects, or only quickstart
  --exclude <PROJECT>  Do not test this project",
        run: projects::run,
    },
    commands::Command {
        name: "python",
        usage: "[--sb3 | --sets <STEPS> | --their-tests <FOLDER>]

  --sb3                   Test the parts for Stable-Baselines3 instead, which installs torch
  --sets <STEPS>          Instead, write all data sets with this many steps each, and read them
                          with the loaders of Minari and OGBench
  --their-tests <FOLDER>  Run the tests of this checkout of Gymnasium 1.4.0 or gymnasium-robotics
                          1.4.2 on these environments instead",
        run: python::run,
    },
    ci::TEST,
    ci::CI,
];

fn main() -> ExitCode {
    let mut arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    if arguments.first().is_some_and(|first| first == "help") {
        arguments.remove(0);
        arguments.push("--help".into());
    }
    let name = arguments.first().and_then(|name| name.to_str()).unwrap_or_default();
    let outcome = match name {
        "-h" | "--help" => say!("{}", overview()).map(|()| ExitCode::SUCCESS),
        "" => {
            commands::tell(overview());
            Ok(ExitCode::from(2))
        }
        _ => match commands::find(name).map(|command| command.program) {
            Some(Program::Chapter) => hand_on("chapter", &arguments),
            Some(Program::Lab) => hand_on("lab", &arguments),
            Some(Program::Xtask) | None => commands::run(&OWN, &arguments),
        },
    };
    outcome.unwrap_or_else(|error| commands::end_with(&error))
}

fn overview() -> String {
    let line = |command: &Listed| format!("  {:<16} {}\n", command.name, command.about);
    let lines: String = COMMANDS.iter().map(line).collect();
    format!(
        "The commands of the Fetch environments\n\nUsage: cargo xtask <COMMAND>\n\nCommands:\n{}\n\
         `cargo xtask help <COMMAND>` lists the arguments of a command.",
        lines
    )
}

/// Replaces this process with a command of a package, so that the command receives its signals; or,
/// where processes cannot be replaced, runs it and returns its exit code.
fn hand_on(package: &str, arguments: &[OsString]) -> anyhow::Result<ExitCode> {
    let missing = match Places::of_machine().find(c_compiler) {
        Ok(Some(_)) => None,
        Ok(None) => Some("MuJoCo's headers were not found".to_owned()),
        Err(wrong) => Some(wrong.to_string()),
    };
    if let Some(missing) = missing {
        let fix = "apt-get update && apt-get install -y libmujoco-dev, or \
                   `cargo xtask mujoco 3.6.0`";
        ensure!(arguments[0] == "doctor", "{missing}: {fix}");
        // Doctor's first finding; without MuJoCo, it cannot look for anything else.
        say!("FAIL  MuJoCo is missing\n      {missing}\n      fix: {fix}")?;
        return Ok(ExitCode::FAILURE);
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["run", "--quiet", "--release", "--manifest-path"])
        .arg(format!("{}/{package}/Cargo.toml", env!("CARGO_MANIFEST_DIR")));
    if arguments.iter().any(|argument| argument == "--mpi") {
        let mpicc = std::env::var_os("MPICC").unwrap_or_else(|| "mpicc".into());
        let is_there = Command::new(&mpicc).arg("-show").output().is_ok();
        ensure!(
            is_there,
            "--mpi needs MPI and Clang, and there is no {}: apt-get update && apt-get install -y \
             libopenmpi-dev openmpi-bin libclang-dev",
            mpicc.display()
        );
        cargo.args(["--features", "mpi"]);
    }
    // Flags of `bench` may stand between the two words.
    if arguments[0] == "bench" && arguments.iter().any(|argument| argument == "learn") {
        cargo.args(["--features", "product"]);
    }
    replace_by(cargo.arg("--").args(arguments))
}

#[cfg(unix)]
fn replace_by(command: &mut Command) -> anyhow::Result<ExitCode> {
    // It returns only if it fails.
    Err(std::os::unix::process::CommandExt::exec(command)).context("cargo did not start")
}

#[cfg(not(unix))]
fn replace_by(command: &mut Command) -> anyhow::Result<ExitCode> {
    let status = command.status().context("cargo did not start")?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

fn c_compiler() -> Command {
    Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_has_the_commands_that_xtask_runs() {
        let listed = commands::of(Program::Xtask).map(|command| command.name);
        assert!(listed.eq(OWN.map(|command| command.name)));
    }
}
