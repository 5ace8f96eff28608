//! The workspace's task runner: `cargo xtask <command>`.
//!
//! It builds within seconds on a bare machine, without MuJoCo and without a C compiler, so that it
//! can fetch MuJoCo or say that it is missing. It hands commands that step environments on to the
//! package `lab`.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not be made, 2 for wrong usage.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use]
mod output;

#[path = "../../fetch-sim/src/cache.rs"]
mod cache;
mod ci;
mod commands;
mod downloads;
#[path = "../../fetch-sim/src/fetch/mod.rs"]
mod fetch;
#[path = "../../fetch-sim/find_mujoco.rs"]
mod find_mujoco;
mod fuzz;
#[path = "../../fetch-sim/src/installation.rs"]
mod installation;
mod mutants;
mod packages;
mod projects;
mod sanitize;
mod tools;

use std::{
    ffi::OsString,
    process::{Command, ExitCode},
};

use anyhow::{Context, ensure};
use lexopt::Parser;

use self::{commands::OF_LAB, find_mujoco::find_mujoco};

/// A command that xtask runs itself.
struct OwnCommand {
    name: &'static str,
    about: &'static str,
    /// Its arguments, and a line for each.
    usage: &'static str,
    run: fn(Parser) -> anyhow::Result<bool>,
}

const OWN: [OwnCommand; 8] = [
    OwnCommand {
        name: "assets",
        about: "Fetch the reference's model into the cache",
        usage: "[--from <WHEEL>]

  --from <WHEEL>  Use this wheel of gymnasium-robotics 1.4.2 instead of downloading it",
        run: downloads::assets,
    },
    OwnCommand {
        name: "mujoco",
        about: "Fetch another version of MuJoCo into the cache",
        usage: "[--from <WHEEL>] <VERSION>

  <VERSION>       The version, such as 3.6.0
  --from <WHEEL>  Use this wheel of that version instead of downloading it",
        run: downloads::other_mujoco,
    },
    OwnCommand {
        name: "fuzz",
        about: "Fuzz what is loaded, and sequences of calls of the replay buffer and of environments",
        usage: "[--seconds <N>] [--target <TARGET>]

  --seconds <N>      Run each target this long [default: 15]
  --target <TARGET>  Run only this target: load, npz or operations of the buffer, values or
                     calls of environments",
        run: fuzz::run,
    },
    OwnCommand {
        name: "sanitize",
        about: "Run tests under sanitizers, Valgrind and Miri",
        usage: "[--only <CHECK>] [--cases <N>]

  --only <CHECK>  Run only this check: shim (AddressSanitizer and UndefinedBehaviorSanitizer on the C
                  code), memory (Valgrind), threads (ThreadSanitizer) or miri
  --cases <N>     Random models of the check shim; memory takes a tenth [default: 256]",
        run: sanitize::run,
    },
    OwnCommand {
        name: "mutants",
        about: "Change the code in small ways, and look whether a test notices",
        usage: "[--crate <CRATE>] [--shard <K/N>] [--commits <N>] [--at-most <N>]

  --crate <CRATE>  Only this crate: goal-reward, her-relabel, fetch-baselines or fetch-env
  --shard <K/N>    Only the part K, from 0, of N
  --commits <N>    Only what the last N commits have changed
  --at-most <N>    At most so many mutants of each crate, spread over the code",
        run: mutants::run,
    },
    OwnCommand {
        name: "packages",
        about: "Check that the crates are ready to be published",
        usage: "[--bless]

  --bless  Write the public interface to each crate's public-api.txt instead of comparing it",
        run: packages::run,
    },
    OwnCommand {
        name: "projects",
        about: "Test the projects that use the crates from outside, and the README's first program",
        usage: "[--only <PROJECT>]

  --only <PROJECT>  Test only this folder of fetch-env/projects, or only quickstart",
        run: projects::run,
    },
    OwnCommand {
        name: "ci",
        about: "Run what continuous integration runs, cheapest checks first",
        usage: "",
        run: ci::run,
    },
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
            output::tell(overview());
            Ok(ExitCode::from(2))
        }
        _ if OF_LAB.iter().any(|(known, _)| *known == name) => hand_on(&arguments),
        _ => run_own(name, &arguments[1..]),
    };
    outcome.unwrap_or_else(|error| {
        if error.is::<lexopt::Error>() {
            output::tell(format_args!("error: {error}"));
            return ExitCode::from(2);
        }
        output::end_with(&error)
    })
}

fn overview() -> String {
    let own = OWN.iter().map(|command| (command.name, command.about));
    let lines =
        OF_LAB.into_iter().chain(own).map(|(name, about)| format!("  {name:<16} {about}\n"));
    format!(
        "The commands of the Fetch environments\n\nUsage: cargo xtask <COMMAND>\n\nCommands:\n{}\n\
         `cargo xtask help <COMMAND>` lists the arguments of a command.",
        lines.collect::<String>()
    )
}

fn run_own(name: &str, arguments: &[OsString]) -> anyhow::Result<ExitCode> {
    let command = OWN.iter().find(|command| command.name == name).ok_or_else(|| {
        lexopt::Error::from(format!("there is no command {name}: see `cargo xtask --help`"))
    })?;
    if arguments.iter().any(|argument| argument == "-h" || argument == "--help") {
        let OwnCommand { about, usage, .. } = command;
        say!("{about}\n\nUsage: cargo xtask {name} {usage}")?;
        return Ok(ExitCode::SUCCESS);
    }
    let passed = (command.run)(Parser::from_args(arguments))?;
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// Runs a command of the lab, and returns its exit code.
fn hand_on(arguments: &[OsString]) -> anyhow::Result<ExitCode> {
    let missing = match find_mujoco(c_compiler) {
        Ok(Some(_)) => None,
        Ok(None) => Some("MuJoCo's headers were not found".to_owned()),
        Err(wrong) => Some(wrong),
    };
    if let Some(missing) = missing {
        let fix = "apt-get update && apt-get install -y libmujoco-dev, or \
                   `cargo xtask mujoco 3.6.0` and set MUJOCO_DIR as it says";
        ensure!(arguments[0] == "doctor", "{missing}: {fix}");
        // Doctor's first finding; it can look for nothing else.
        say!("FAIL  MuJoCo is missing\n      {missing}\n      fix: {fix}")?;
        return Ok(ExitCode::FAILURE);
    }
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["run", "--quiet", "--release", "--manifest-path"])
        .arg(concat!(env!("CARGO_MANIFEST_DIR"), "/lab/Cargo.toml"));
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
    let status = cargo.arg("--").args(arguments).status().context("cargo did not start")?;
    let code = status.code().and_then(|code| u8::try_from(code).ok());
    Ok(code.map_or(ExitCode::FAILURE, ExitCode::from))
}

fn c_compiler() -> Command {
    Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
}
