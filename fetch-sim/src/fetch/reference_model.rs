//! The reference's model, from the wheel of gymnasium-robotics.
//!
//! The license of the vendor's meshes forbids commercial use: the repository never holds them, and
//! only those who ask for them get them.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    error::FetchError,
    wheel::{Wheel, check_sha256, replace_folder, write},
};
use crate::cache;

const REQUIREMENT: &str = "gymnasium-robotics==1.4.2";
const FOLDER_IN_WHEEL: &str = "gymnasium_robotics/envs/assets";

/// Fetch's files below [`FOLDER_IN_WHEEL`], as `sha256sum` lists them.
const FILES: &str = include_str!("reference_model.sha256");

/// Fetches the reference's model into the user's cache, or into `FETCH_ASSETS_DIR`, unless it is there
/// complete and as published, and returns its folder.
///
/// Its meshes are under CC BY-NC-SA 4.0: not for commercial use.
///
/// # Errors
/// Any [`FetchError`] but [`FetchError::Version`].
pub fn reference_model() -> Result<PathBuf, FetchError> {
    let folder = folder()?;
    if !is_complete(&folder) {
        unpack(Wheel::open_or_fetch(None, REQUIREMENT)?, &folder)?;
    }
    Ok(folder)
}

/// As [`reference_model`], from the wheel of gymnasium-robotics 1.4.2 at a path.
///
/// # Errors
/// As [`reference_model`].
pub fn reference_model_from_wheel(wheel: &Path) -> Result<PathBuf, FetchError> {
    let folder = folder()?;
    unpack(Wheel::open_or_fetch(Some(wheel), REQUIREMENT)?, &folder)?;
    Ok(folder)
}

fn folder() -> Result<PathBuf, FetchError> {
    cache::reference_folder().ok_or(FetchError::NoCache)
}

fn files() -> impl Iterator<Item = (&'static str, &'static str)> {
    FILES.lines().filter_map(|line| line.split_once("  ")).map(|(sha256, name)| (name, sha256))
}

fn unpack(mut wheel: Wheel, folder: &Path) -> Result<(), FetchError> {
    replace_folder(folder, |new| {
        for (name, sha256) in files() {
            let bytes = wheel.read(&format!("{FOLDER_IN_WHEEL}/{name}"))?;
            check_sha256(name, &bytes, sha256)?;
            write(new, name, &bytes)?;
        }
        Ok(())
    })
}

fn is_complete(folder: &Path) -> bool {
    files().all(|(name, sha256)| {
        fs::read(folder.join(name)).is_ok_and(|bytes| check_sha256(name, &bytes, sha256).is_ok())
    })
}
