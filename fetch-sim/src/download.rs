//! Downloading MuJoCo and the reference's model into the user's cache (feature `download`).
//!
//! These are the functions of `fetch_install::download`, for programs that may have more privileges
//! than the user who started them: in such a program they return [`DownloadError::NoCache`].
//! From the command line: `cargo run -p fetch-sim --example download --features download`.

use std::path::{Path, PathBuf};

use fetch_install::download;
pub use fetch_install::download::{DownloadError, export_line};

use crate::privileges::are_raised;

/// Downloads a version of MuJoCo, such as `3.6.0`, into the user's cache, unless a complete copy
/// is there, and returns its folder.
///
/// To build with it, set `MUJOCO_DIR` to the folder, as [`export_line`] does, or use [`remember`]. A
/// program that was built with the headers of this version finds the library by itself.
///
/// # Errors
/// Any [`DownloadError`].
pub fn mujoco(version: &str) -> Result<PathBuf, DownloadError> {
    in_own_cache(|| download::mujoco(version))
}

/// Downloads a version of MuJoCo for programs of another system or processor, such as
/// `aarch64-linux`, and returns its folder, as [`mujoco`] does. Use it to build for that platform
/// on this one. The names are those of [`std::env::consts`], with the processor first.
///
/// # Errors
/// As [`mujoco`].
pub fn mujoco_for(version: &str, platform: &str) -> Result<PathBuf, DownloadError> {
    in_own_cache(|| download::mujoco_for(version, platform))
}

/// Unpacks a version of MuJoCo from a wheel of the package `mujoco`, or from 4.0 on of
/// `mujoco-core`, for the platform of this program, and returns its folder, as [`mujoco`] does.
///
/// # Errors
/// As [`mujoco`].
pub fn mujoco_from_wheel(version: &str, wheel: &Path) -> Result<PathBuf, DownloadError> {
    in_own_cache(|| download::mujoco_from_wheel(version, wheel))
}

/// Downloads a version of MuJoCo as [`mujoco`] does, and remembers it for the platform of this
/// program: builds and programs take it from then on, unless `MUJOCO_DIR` names another. It replaces
/// the version that was remembered before, which [`remembered_mujoco`](crate::remembered_mujoco)
/// returns.
///
/// # Errors
/// As [`mujoco`].
pub fn remember(version: &str) -> Result<PathBuf, DownloadError> {
    in_own_cache(|| download::remember(version))
}

/// Forgets the version that [`remember`] has remembered, and returns whether there was one. Its
/// files stay in the cache.
///
/// # Errors
/// [`DownloadError::NoCache`] and [`DownloadError::Write`].
pub fn forget() -> Result<bool, DownloadError> {
    in_own_cache(download::forget)
}

/// Downloads the reference's model into the user's cache, or into `FETCH_ASSETS_DIR`, unless a
/// complete copy is there, and returns its folder. Files of the model with different contents are
/// replaced, and other files stay.
///
/// Its meshes are under CC BY-NC-SA 4.0: not for commercial use.
///
/// # Errors
/// Any [`DownloadError`] except [`DownloadError::Version`].
pub fn reference_model() -> Result<PathBuf, DownloadError> {
    in_own_cache(download::reference_model)
}

/// Unpacks the reference's model from a wheel of gymnasium-robotics 1.4.2, and returns its folder,
/// as [`reference_model`] does.
///
/// # Errors
/// As [`reference_model`].
pub fn reference_model_from_wheel(wheel: &Path) -> Result<PathBuf, DownloadError> {
    in_own_cache(|| download::reference_model_from_wheel(wheel))
}

/// Changes the cache, unless the variables and the home that say where it is are another user's.
fn in_own_cache<T>(change: impl FnOnce() -> Result<T, DownloadError>) -> Result<T, DownloadError> {
    if are_raised() { Err(DownloadError::NoCache) } else { change() }
}
