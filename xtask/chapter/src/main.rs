//! The chapter's commands: `cargo xtask <command>` hands them on to this program.
//!
//! Exit codes: 0 if everything passed, 1 if a check failed or could not run, 2 for wrong usage.
#![forbid(unsafe_code)]

use std::{ffi::OsString, process::ExitCode};

fn main() -> ExitCode {
    let arguments: Vec<OsString> = std::env::args_os().skip(1).collect();
    commands::run(&chapter::COMMANDS, &arguments).unwrap_or_else(|error| commands::end_with(&error))
}
