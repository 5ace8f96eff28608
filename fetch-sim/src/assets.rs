//! Sources of the robot's model.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::{cache::reference_folder, error::SimError, task::Task};

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
    /// A folder with `reach.xml`, `push.xml`, `pick_and_place.xml` and `slide.xml`, in which
    /// bodies, joints and sites have the reference's names.
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
            Self::Reference => {
                let no_home = || SimError::NoAssets { path: "the user's cache".into() };
                reference_folder().ok_or_else(no_home)?.join("fetch")
            }
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
