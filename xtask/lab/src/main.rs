//! The commands that only developers run and that step environments: `cargo xtask <command>` hands
//! them on to this program.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use(say)]
extern crate fetch_cli;

mod bench;
mod parity;
mod shared;
mod soak;
mod tasks_page;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use fetch_cli::output;

#[derive(Parser)]
#[command(name = "cargo xtask", bin_name = "cargo xtask")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Compare with the real environment: recorded, live, pictures, samples, policies
    Parity(parity::Args),
    /// Measure speed and memory
    Bench(bench::Args),
    /// Step, save and render environments for a long time, and look for leaks
    Soak(soak::Args),
    /// Write the page of the tasks from the tables in the code
    TasksPage(tasks_page::Args),
}

fn main() -> ExitCode {
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(ended) => return ExitCode::from(output::end_of_parsing(&ended)),
    };
    ExitCode::from(output::exit_code(match cli.command {
        Command::Parity(args) => parity::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Soak(args) => soak::run(&args),
        Command::TasksPage(args) => tasks_page::run(&args),
    }))
}
