//! The workspace's task runner: `cargo xtask <command>`.
//!
//! It builds within seconds on a bare machine, without MuJoCo and without a C compiler, so that it
//! can say what is missing. It hands every command that is not its own on: to the package `lab`, or
//! to the program `fetch-env` (the package `fetch-cli`).
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use]
#[path = "../../baselines/program/src/output.rs"]
mod output;

mod ci;
mod fuzz;
mod handing_on;
mod mutants;
mod package_build;
mod packages;
mod platforms;
mod projects;
mod python;
mod sanitize;
mod tools;
mod wheels;

use std::{ffi::OsString, process::ExitCode};

use clap::{Parser, Subcommand};

/// The commands of this repository
#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask", disable_help_subcommand = true)]
#[command(after_help = OTHERS)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const OTHERS: &str = "Every other command is the program's: `cargo xtask train` is `fetch-env \
    train`, and `cargo run --release -p fetch-cli -- --help` lists them.\n\
    `cargo xtask help <COMMAND>` lists the arguments of a command.";

#[derive(Subcommand)]
enum Command {
    /// Run all tests that need only Rust and MuJoCo, and list what was left out
    Test,
    /// Run what continuous integration runs: `test`, then everything that needs more
    Ci(ci::Args),
    /// Fuzz loading, and sequences of calls to the replay buffer and to environments
    Fuzz(fuzz::Args),
    /// Run tests under sanitizers, Valgrind and Miri
    Sanitize(sanitize::Args),
    /// Change the code in small ways, and check that a test fails
    Mutants(mutants::Args),
    /// Check that the crates are ready to be published
    Packages(packages::Args),
    /// Build and test the crates for other systems and processors
    Platforms(platforms::Args),
    /// Test projects that depend on the crates, one of them made from the README
    Projects(projects::Args),
    /// Build the Python package, and test it beside the reference
    Python(python::Args),
    /// Build the Python package's wheels for all platforms on this one, and audit them
    Wheels(wheels::Args),
    /// Compare with the real environment: recorded, live, pictures, samples, policies
    Parity(handing_on::Rest),
    /// Measure speed and memory
    Bench(handing_on::Rest),
    /// Step, save and render environments for a long time, and look for leaks
    Soak(handing_on::Rest),
    /// Write the page of the tasks from the tables in the code
    TasksPage(handing_on::Rest),
    #[command(external_subcommand)]
    Program(Vec<OsString>),
}

fn main() -> ExitCode {
    let mut arguments: Vec<OsString> = std::env::args_os().collect();
    if arguments.get(1).is_some_and(|first| first == "help") {
        arguments.remove(1);
        arguments.push("--help".into());
    }
    let command = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli.command,
        Err(ended) => return ExitCode::from(output::end_of_parsing(&ended)),
    };
    let outcome = match command {
        Command::Test => ci::test(),
        Command::Ci(args) => ci::run(&args),
        Command::Fuzz(args) => fuzz::run(&args),
        Command::Sanitize(args) => sanitize::run(&args),
        Command::Mutants(args) => mutants::run(&args),
        Command::Packages(args) => packages::run(&args),
        Command::Platforms(args) => platforms::run(&args),
        Command::Projects(args) => projects::run(&args),
        Command::Python(args) => python::run(&args),
        Command::Wheels(args) => wheels::run(&args),
        Command::Parity(_) | Command::Bench(_) | Command::Soak(_) | Command::TasksPage(_) => {
            return handed_on(handing_on::to_lab(&arguments[1..]));
        }
        Command::Program(words) => return handed_on(handing_on::to_program(&words)),
    };
    ExitCode::from(output::exit_code(outcome))
}

fn handed_on(code: anyhow::Result<u8>) -> ExitCode {
    ExitCode::from(code.unwrap_or_else(|error| output::exit_code(Err(error))))
}

fn c_compiler() -> std::process::Command {
    std::process::Command::new(std::env::var_os("CC").unwrap_or_else(|| "cc".into()))
}
