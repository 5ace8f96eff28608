//! The program as a user runs it.

use std::process::Command;

/// Returns a command of the program, whose arguments are separated by spaces.
pub(crate) fn fetch(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fetch-env"));
    command.args(arguments.split_whitespace()).current_dir(env!("CARGO_MANIFEST_DIR"));
    command
}
