//! Programs as a user runs them.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
};

use serde_json::Value;

use crate::Result;

/// Returns the standard output of a command that must succeed.
///
/// # Panics
/// The command fails.
///
/// # Errors
/// It cannot be started, or prints something else than text.
pub fn output_of(command: &mut Command) -> Result<String> {
    let output = command.output()?;
    let text = String::from_utf8(output.stdout)?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{command:?}\n{text}\n{errors}");
    Ok(text)
}

/// Returns what a command printed on standard error.
pub fn errors_of(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Reads a file of JSON.
///
/// # Errors
/// It cannot be read, or is no JSON.
pub fn read_json(path: &Path) -> Result<Value> {
    Ok(serde_json::from_str(&fs::read_to_string(path)?)?)
}
