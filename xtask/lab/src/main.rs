//! The commands that step environments and are not the chapter's: `cargo xtask <command>` hands
//! them on to this program.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage,
//! 130 and 143 if SIGINT or SIGTERM stopped it in good order.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "a binary's items are public to its own modules only")]

#[macro_use(say)]
extern crate commands;

mod bench;
mod collect;
mod datasets;
mod figures;
mod learning_curves;
mod parity;
mod plan;
mod play;
mod report;
mod shared;
mod soak;
mod train;

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

use commands::Program;

use self::shared::signals::Stopped;

#[derive(Parser)]
#[command(
    name = "cargo xtask",
    bin_name = "cargo xtask",
    about = "The commands of the Fetch environments"
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Parity(parity::Args),
    Bench(bench::Args),
    Figures(figures::Args),
    Report(report::Args),
    Play(play::Args),
    Plan(plan::Args),
    Collect(collect::Args),
    Datasets(datasets::Args),
    Train(Box<train::Args>),
    LearningCurves(learning_curves::Args),
    Soak(soak::Args),
}

/// Parses the arguments, with the descriptions of the commands from the list.
fn parse() -> Cli {
    let mut cli = Cli::command();
    for listed in commands::of(Program::Lab) {
        cli = cli.mut_subcommand(listed.name, |command| command.about(listed.about));
    }
    Cli::from_arg_matches(&cli.get_matches()).unwrap_or_else(|error| error.exit())
}

fn main() -> ExitCode {
    let outcome = match parse().command {
        Command::Parity(args) => parity::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Figures(args) => figures::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Play(args) => play::run(&args),
        Command::Plan(args) => plan::run(&args),
        Command::Collect(args) => collect::run(&args),
        Command::Datasets(args) => datasets::run(&args),
        Command::Train(args) => train::run(&args),
        Command::LearningCurves(args) => learning_curves::run(&args),
        Command::Soak(args) => soak::run(&args),
    };
    match outcome {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::FAILURE,
        Err(error) => {
            if let Some(stopped) = error.downcast_ref::<Stopped>() {
                return ExitCode::from(stopped.exit_code());
            }
            let Some(usage) = error.downcast_ref::<clap::Error>() else {
                return commands::end_with(&error);
            };
            commands::tell(usage.to_string().trim_end());
            ExitCode::from(2)
        }
    }
}
