//! MuJoCo's library, and the reference's model.

use std::path::PathBuf;

use crate::error::Result;
use fetch_env::{ModelSource, Task};
use fetch_sim::download;
use pyo3::{exceptions::PyOSError, prelude::*};

/// Unpacks the reference's model from its wheel into the user's cache, and returns its folder.
#[pyfunction]
pub(crate) fn unpack_reference_model(py: Python<'_>, wheel: PathBuf) -> PyResult<PathBuf> {
    py.detach(|| download::reference_model_from_wheel(&wheel))
        .map_err(|error| PyOSError::new_err(error.to_string()))
}

/// Whether the user's cache has the reference's model.
#[pyfunction]
pub(crate) fn has_reference_model() -> bool {
    Task::ALL.iter().all(|&task| ModelSource::Reference.scene_path(task).is_ok())
}

/// Uses MuJoCo from this file; call it before anything uses MuJoCo.
#[pyfunction]
pub(crate) fn use_library(path: PathBuf) -> Result<()> {
    Ok(fetch_sim::use_library(path)?)
}

/// The path of MuJoCo's library, loading the library first if necessary.
#[pyfunction]
pub(crate) fn library_path() -> Result<PathBuf> {
    Ok(fetch_sim::library_path()?)
}
