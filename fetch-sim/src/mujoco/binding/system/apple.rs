//! macOS.

use std::{
    env,
    path::{Path, PathBuf},
};

use super::super::version::MujocoVersion;
use crate::privileges;

/// The plain name of MuJoCo's library.
pub(in super::super) const LIBRARY: &str = "libmujoco.dylib";

/// The names of the plugins that read mesh files.
pub(in super::super) const DECODER_FILES: [&str; 2] =
    ["libstl_decoder.dylib", "libobj_decoder.dylib"];

/// Returns the name that MuJoCo gives the library of a version.
pub(in super::super) fn library_name(version: MujocoVersion) -> String {
    format!("libmujoco.{version}.dylib")
}

/// Returns the folders in which the system's loader looks for libraries.
pub(in super::super) fn folders() -> Vec<PathBuf> {
    let of_user = env::var_os("DYLD_LIBRARY_PATH").filter(|_| !privileges::are_raised());
    let of_user = of_user.iter().flat_map(env::split_paths).filter(|path| path.is_absolute());
    of_user.chain([PathBuf::from("/usr/local/lib")]).collect()
}

/// Returns no name: the version is in the file name, or is asked of the loaded library. The system
/// refuses a truncated file.
pub(in super::super) fn own_name(_: &Path) -> Result<Option<String>, String> {
    Ok(None)
}
