//! The program `fetch-env` as a function, [`main`], for the binary and for other hosts, such as the
//! Python package; and what the commands of developers share with it.
//!
//! Without the feature `full` it has the commands that are quick to build.
#![forbid(unsafe_code)]
#![allow(unreachable_pub, reason = "most items are public to the program's own modules only")]

#[macro_use]
pub mod output;

mod chapter;
#[cfg(feature = "full")]
mod collect;
mod command;
#[cfg(feature = "full")]
mod completions;
#[cfg(feature = "full")]
mod datasets;
#[cfg(feature = "full")]
mod evaluate;
#[cfg(feature = "full")]
mod figures;
mod install;
#[cfg(feature = "full")]
mod learning_curves;
#[cfg(feature = "full")]
mod plan;
#[cfg(feature = "full")]
mod play;
#[cfg(feature = "full")]
mod report;
#[cfg(feature = "full")]
mod robustness;
pub mod shared;
#[cfg(feature = "full")]
mod train;

use std::ffi::OsString;

use clap::{CommandFactory, Parser};

use self::command::{Cli, Command};
#[cfg(feature = "full")]
use self::shared::tasks::Tasks;

/// Runs the program with arguments, which do not begin with the program's name, and returns its
/// exit code: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage, 130
/// and 143 if SIGINT or SIGTERM stopped it in good order.
///
/// It writes to the standard streams of the process. `train`, `plan`, `datasets`, and `collect` with
/// `--format`, listen to SIGINT and SIGTERM from their beginning on, also after this function has
/// returned. In all other commands, signals do what the host has set.
///
/// `train`, `evaluate`, `robustness`, `play`, `plan`, `collect` and `datasets` act in environments that
/// `tasks` makes, [built-in](baselines::runs::BuiltInTasks) ones or the host's own.
#[cfg(feature = "full")]
pub fn main(tasks: &impl Tasks, arguments: impl IntoIterator<Item = OsString>) -> u8 {
    run(arguments, |command| command.run(tasks))
}

/// Runs the program with arguments, which do not begin with the program's name, and returns its
/// exit code: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage.
///
/// It writes to the standard streams of the process. Signals do what the host has set.
#[cfg(not(feature = "full"))]
pub fn main(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    run(arguments, Command::run)
}

/// Parses the arguments, runs the command, and returns the exit code.
fn run(
    arguments: impl IntoIterator<Item = OsString>,
    run: impl FnOnce(&Command) -> anyhow::Result<bool>,
) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(ended) => return output::end_of_parsing(&ended),
    };
    let outcome = run(&cli.command);
    #[cfg(feature = "full")]
    if let Err(error) = &outcome
        && let Some(stopped) = error.downcast_ref::<shared::signals::Stopped>()
    {
        return stopped.exit_code();
    }
    output::exit_code(outcome)
}

/// Returns the parser of the arguments, which knows every command, its flags and an example.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}
