//! The program `fetch-env`.

use std::ffi::OsString;

use pyo3::prelude::*;

use crate::task::AnyTasks;

/// Runs the program with arguments, which do not begin with its name, and returns its exit code.
#[pyfunction]
pub(crate) fn run_program(py: Python<'_>, arguments: Vec<OsString>) -> u8 {
    py.detach(|| fetch_cli::main_on(&AnyTasks::default(), arguments))
}
