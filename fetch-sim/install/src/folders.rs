//! The variables and folders that say where MuJoCo and the models are.

use std::{
    env::{
        self,
        consts::{ARCH, OS},
    },
    path::PathBuf,
};

/// The value of `MUJOCO_DIR` that stands for no MuJoCo at all.
pub const NONE: &str = "none";

/// Returns the value of `MUJOCO_DIR`: a folder, or the library's file; `None` if it is unset or
/// empty.
#[must_use]
pub fn mujoco_dir() -> Option<PathBuf> {
    non_empty("MUJOCO_DIR")
}

/// Returns the folder of the reference's model, which need not exist: `FETCH_ASSETS_DIR` if that is
/// set, and otherwise a folder in [`cache_folder`]. `None` if the user has no home.
#[must_use]
pub fn reference_folder() -> Option<PathBuf> {
    non_empty("FETCH_ASSETS_DIR").or_else(|| Some(cache_folder()?.join("gymnasium-robotics-1.4.2")))
}

/// Returns the folder `fetch-env` in the user's cache (`XDG_CACHE_HOME`, or `.cache` at home),
/// which need not exist. `None` if the user has no home.
#[must_use]
pub fn cache_folder() -> Option<PathBuf> {
    let cache = non_empty("XDG_CACHE_HOME")
        .filter(|path| path.is_absolute())
        .or_else(|| Some(env::home_dir()?.join(".cache")))?;
    Some(cache.join("fetch-env"))
}

/// Returns the name of the platform of this program, such as `aarch64-linux`.
#[must_use]
pub fn own_platform() -> String {
    format!("{ARCH}-{OS}")
}

/// Returns the name of the folder of a version of MuJoCo in [`cache_folder`], for a platform such
/// as `aarch64-linux`: machines of several kinds may share a home. `x86_64-linux` is left out of
/// the name.
#[must_use]
pub fn name_in_cache(version: &str, platform: &str) -> String {
    match platform {
        "x86_64-linux" => format!("mujoco-{version}"),
        _ => format!("mujoco-{version}-{platform}"),
    }
}

fn non_empty(variable: &str) -> Option<PathBuf> {
    env::var_os(variable).filter(|value| !value.is_empty()).map(PathBuf::from)
}
