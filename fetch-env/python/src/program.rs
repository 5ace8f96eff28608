//! The program `fetch-env`.

use std::ffi::OsString;

use pyo3::prelude::*;

use crate::error::Result;
use crate::task::AnyTasks;

/// Runs the program with arguments, which do not begin with its name, and returns its exit code. Its
/// environments have the task in Python, if there is one.
#[pyfunction]
#[pyo3(signature = (arguments, task = None))]
pub(crate) fn run_program(
    py: Python<'_>,
    arguments: Vec<OsString>,
    task: Option<&Bound<'_, PyAny>>,
) -> Result<u8> {
    let tasks = task.map(AnyTasks::of_task).transpose()?.unwrap_or_default();
    let code = py.detach(|| fetch_cli::main(&tasks, arguments));
    tasks.check()?;
    Ok(code)
}
