//! Sources of the robot's model, and the folders of those that are files.

use std::{
    env,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use crate::{error::SimError, task::Task};

/// Source of the robot's model.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ModelSource {
    /// The crate's own model: the reference's numbers, simple shapes.
    #[default]
    Builtin,
    /// The reference's model with the vendor's meshes, from the user's cache, where
    /// `cargo xtask assets` puts it.
    Reference,
    /// A folder with `reach.xml`, `push.xml`, `pick_and_place.xml` and `slide.xml`, in which bodies,
    /// joints and sites have the reference's names.
    Folder(PathBuf),
}

impl ModelSource {
    /// Returns the file of a task's scene; `None` for the built-in model, which is not a file.
    ///
    /// # Errors
    /// [`SimError::NoAssets`] if the file is missing.
    pub fn scene_path(&self, task: Task) -> Result<Option<PathBuf>, SimError> {
        let folder = match self {
            Self::Builtin => return Ok(None),
            Self::Reference => reference_folder()?.join("fetch"),
            Self::Folder(folder) => folder.clone(),
        };
        let path = folder.join(task.spec().scene_file);
        if path.is_file() {
            Ok(Some(path))
        } else {
            Err(SimError::NoAssets { path: path.display().to_string() })
        }
    }
}

/// Returns the folder of the reference model, which need not exist: `FETCH_ASSETS_DIR` if that is
/// set, and otherwise a folder in [`cache_folder`].
///
/// # Errors
/// [`SimError::NoAssets`] if the user has no home.
pub fn reference_folder() -> Result<PathBuf, SimError> {
    match non_empty("FETCH_ASSETS_DIR") {
        Some(folder) => Ok(folder),
        None => Ok(cache_folder()?.join("gymnasium-robotics-1.4.2")),
    }
}

/// The folder `fetch-env` in the user's cache: `XDG_CACHE_HOME`, or `.cache` at home.
///
/// # Errors
/// [`SimError::NoAssets`] if the user has no home.
pub fn cache_folder() -> Result<PathBuf, SimError> {
    let cache = non_empty("XDG_CACHE_HOME")
        .filter(|path| path.is_absolute())
        .or_else(|| Some(env::home_dir()?.join(".cache")))
        .ok_or_else(|| SimError::NoAssets { path: "the user's cache".into() })?;
    Ok(cache.join("fetch-env"))
}

fn non_empty(variable: &str) -> Option<PathBuf> {
    env::var_os(variable)
        .filter(|value| !value.is_empty())
        .map(|value| Path::new(&value).to_path_buf())
}
