//! The output of a command: lines on standard output, which may be a closed pipe or a full disk,
//! and the final error on standard error.

use std::{
    fmt,
    io::{self, Write},
    process::ExitCode,
};

use anyhow::Context;

/// Prints a line to standard output, as `println!` does, and returns an error where that panics.
#[macro_export]
macro_rules! say {
    ($($line:tt)*) => { $crate::write_line(format_args!($($line)*)) };
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

/// Prints why a command ended, and returns its exit code: 2 for wrong arguments, otherwise 1. A
/// closed pipe is not a failure: its reader has seen enough.
pub fn end_with(error: &anyhow::Error) -> ExitCode {
    let kind = error.root_cause().downcast_ref().map(io::Error::kind);
    if error.is::<Unwritable>() && kind == Some(io::ErrorKind::BrokenPipe) {
        return ExitCode::SUCCESS;
    }
    if error.is::<lexopt::Error>() {
        // Its source says the same.
        tell(format_args!("error: {error}"));
        return ExitCode::from(2);
    }
    tell(format_args!("error: {error:#}"));
    ExitCode::FAILURE
}
