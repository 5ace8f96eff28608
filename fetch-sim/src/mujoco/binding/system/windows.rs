//! Windows.
//!
//! The permissions of a file are in access control lists, which are not read here. So libraries are
//! taken from fewer places: not from the system's folders, nor from a folder beside the
//! executable's.

use std::{
    fs, io,
    path::{self, Path, PathBuf},
};

use super::super::version::MujocoVersion;

/// The name of MuJoCo's library, whatever its version.
pub(in super::super) const LIBRARY: &str = "mujoco.dll";

/// The names of the plugins that read mesh files.
pub(in super::super) const DECODER_FILES: [&str; 2] = ["stl_decoder.dll", "obj_decoder.dll"];

/// Returns the name that MuJoCo gives the library of a version.
pub(in super::super) fn library_name(_: MujocoVersion) -> String {
    LIBRARY.into()
}

/// Returns no folders: others may write to those in `PATH`.
pub(in super::super) fn folders() -> Vec<PathBuf> {
    Vec::new()
}

/// Returns the absolute path of a file, in the form that users know, unlike
/// [`fs::canonicalize`].
pub(in super::super) fn resolve(file: &Path) -> io::Result<PathBuf> {
    fs::metadata(file)?;
    path::absolute(file)
}

/// Returns the file's name, under which the system knows the library once it is loaded. The system
/// refuses a truncated file.
pub(in super::super) fn own_name(file: &Path) -> Result<Option<String>, String> {
    Ok(file.file_name().and_then(|name| name.to_str()).map(str::to_owned))
}

/// Accepts every file.
pub(in super::super) fn check_owners(_: &Path) -> Result<(), String> {
    Ok(())
}

/// Returns true, because it is not known whether others may put files into a folder.
pub(in super::super) fn is_shared(_: &Path) -> bool {
    true
}
