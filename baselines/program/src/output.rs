//! The output of a command: lines on standard output, which may be a closed pipe or a full disk,
//! and the final error on standard error.

use std::{
    fmt,
    io::{self, Write},
};

use anyhow::Context;
use clap::error::ErrorKind;

/// Prints a line to standard output, as `println!` does, and returns an error where that panics.
#[macro_export]
macro_rules! say {
    ($($line:tt)*) => { $crate::output::write_line(format_args!($($line)*)) };
}

/// The mark of an error of [`say!`].
#[derive(Debug)]
struct Unwritable;

impl fmt::Display for Unwritable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("cannot write to standard output")
    }
}

/// Prints a line to standard output; [`say!`] calls it.
///
/// # Errors
/// Standard output is closed or full.
pub fn write_line(line: fmt::Arguments<'_>) -> anyhow::Result<()> {
    writeln!(io::stdout(), "{line}").context(Unwritable)
}

/// Prints a line to standard error, and ignores a failure to do so. It is written in one piece, so
/// that lines of other processes, such as `mpirun`, come before or after it.
pub fn tell(line: impl fmt::Display) {
    let _ = io::stderr().write_all(format!("{line}\n").as_bytes());
}

/// Returns the error of wrong usage, which ends a command as the parser's own errors do.
pub fn usage(message: impl fmt::Display) -> anyhow::Error {
    clap::Error::raw(ErrorKind::ValueValidation, format!("{message}\n")).into()
}

/// Returns the exit code of a command, and prints the error that ended it: 0 if everything passed,
/// 2 for wrong usage, otherwise 1. A closed pipe is not a failure: its reader has seen enough.
pub fn exit_code(outcome: anyhow::Result<bool>) -> u8 {
    let error = match outcome {
        Ok(passed) => return u8::from(!passed),
        Err(error) => error,
    };
    let kind = error.root_cause().downcast_ref().map(io::Error::kind);
    if error.is::<Unwritable>() && kind == Some(io::ErrorKind::BrokenPipe) {
        return 0;
    }
    if let Some(usage) = error.downcast_ref::<clap::Error>() {
        tell(usage.to_string().trim_end());
        return 2;
    }
    tell(format_args!("error: {error:#}"));
    1
}

/// Prints what the parser of arguments returns instead of arguments, help or an error, and returns
/// the exit code.
pub fn end_of_parsing(error: &clap::Error) -> u8 {
    match error.print() {
        Err(failed) if !error.use_stderr() => exit_code(Err(failed).context(Unwritable)),
        _ => u8::try_from(error.exit_code()).unwrap_or(1),
    }
}
