//! Folders that appear whole or not at all.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempDir};

use super::error::DatasetError;

/// A folder that is filled under a temporary name, `.NAME.xxxxxx` beside its place, and then
/// renamed.
///
/// Dropping it before that removes the folder. A process that is killed leaves the folder under the
/// temporary name.
#[derive(Debug)]
pub(super) struct StagedFolder {
    target: PathBuf,
    folder: TempDir,
}

impl StagedFolder {
    /// Creates the folder under its temporary name, and the parents of its place.
    pub(super) fn create(target: PathBuf) -> Result<Self, DatasetError> {
        if fs::symlink_metadata(&target).is_ok() {
            return Err(DatasetError::Exists { path: target });
        }
        let parent = target.parent().filter(|parent| !parent.as_os_str().is_empty());
        let parent = parent.unwrap_or(Path::new("."));
        fs::create_dir_all(parent).map_err(DatasetError::file(parent))?;
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let prefix = format!(".{name}.");
        let mut builder = Builder::new();
        builder.prefix(&prefix);
        // The permissions of an ordinary folder: by default only its owner could read it.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let folder = builder.tempdir_in(parent).map_err(DatasetError::file(parent))?;
        Ok(Self { target, folder })
    }

    pub(super) fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Writes a file of JSON in the folder.
    #[cfg(any(feature = "lerobot", feature = "ogbench"))]
    pub(super) fn write_json(
        &self,
        name: &str,
        value: &impl serde::Serialize,
    ) -> Result<(), DatasetError> {
        let path = self.path().join(name);
        let json = serde_json::to_string_pretty(value).map_err(io::Error::other);
        json.and_then(|json| fs::write(&path, json + "\n")).map_err(DatasetError::file(&path))
    }

    /// Renames the folder to its final name.
    pub(super) fn publish(self) -> Result<(), DatasetError> {
        let Self { target, folder } = self;
        match fs::rename(folder.path(), &target) {
            Ok(()) => {
                // There is nothing left to remove under the temporary name.
                let _ = folder.keep();
                Ok(())
            }
            Err(error) if error.kind() == io::ErrorKind::DirectoryNotEmpty => {
                Err(DatasetError::Exists { path: target })
            }
            Err(error) => Err(DatasetError::file(&target)(error)),
        }
    }
}
