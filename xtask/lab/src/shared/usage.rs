//! Errors of wrong flags.

use std::fmt::Display;

use clap::error::ErrorKind;

/// Returns the error of a wrong flag, which ends a command as clap's own errors do.
pub fn usage(message: impl Display) -> anyhow::Error {
    clap::Error::raw(ErrorKind::ValueValidation, format!("{message}\n")).into()
}
