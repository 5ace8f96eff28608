//! The commands of a program, and how one is run.

use std::{ffi::OsString, process::ExitCode};

use lexopt::Parser;

use crate::names;

/// A command of a program.
#[derive(Clone, Copy, Debug)]
pub struct Command {
    /// Its name in the [list](crate::COMMANDS) of all commands.
    pub name: &'static str,
    /// Its arguments, and a line for each.
    pub usage: &'static str,
    /// Runs it with the arguments after its name, and returns whether everything passed.
    pub run: fn(Parser) -> anyhow::Result<bool>,
}

/// Runs the command that the first argument names, or prints its help.
///
/// # Errors
/// A [`lexopt::Error`] if there is no such command or its arguments are wrong; otherwise the
/// command's error.
pub fn run(commands: &[Command], arguments: &[OsString]) -> anyhow::Result<ExitCode> {
    let name = arguments.first().and_then(|name| name.to_str()).unwrap_or_default();
    let command = commands.iter().find(|command| command.name == name).ok_or_else(|| {
        lexopt::Error::from(format!("there is no command {name}: see `cargo xtask --help`"))
    })?;
    let arguments = &arguments[1..];
    if arguments.iter().any(|argument| argument == "-h" || argument == "--help") {
        let about = names::find(name).map_or("", |listed| listed.about);
        crate::say!("{about}\n\nUsage: cargo xtask {name} {}", command.usage)?;
        return Ok(ExitCode::SUCCESS);
    }
    let passed = (command.run)(Parser::from_args(arguments))?;
    Ok(if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}
