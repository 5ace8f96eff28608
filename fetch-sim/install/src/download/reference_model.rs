//! The reference's model, from the wheel of gymnasium-robotics.
//!
//! The license of the vendor's meshes forbids commercial use: the repository never holds them, and
//! only those who ask for them get them.

use std::path::{Path, PathBuf};

use super::{checksums, error::DownloadError, unpacking::Unpacking, wheel::Wheel};
use crate::{
    contents::{self, Listed},
    folders::reference_folder,
};

const REQUIREMENT: &str = "gymnasium-robotics==1.4.2";
const FOLDER_IN_WHEEL: &str = "gymnasium_robotics/envs/assets";

/// Fetch's files below [`FOLDER_IN_WHEEL`], as `sha256sum` lists them.
const FILES: &str = include_str!("reference_model.sha256");

/// Downloads the reference's model into the user's cache, or into `FETCH_ASSETS_DIR`, unless a
/// complete copy is there, and returns its folder. Files of the model with different contents are
/// replaced, and other files stay.
///
/// Its meshes are under CC BY-NC-SA 4.0: not for commercial use.
///
/// # Errors
/// Any [`DownloadError`] except [`DownloadError::Version`].
pub fn reference_model() -> Result<PathBuf, DownloadError> {
    let folder = folder()?;
    let put = |unpacking: &Unpacking<'_>| {
        put(&mut Wheel::fetch(REQUIREMENT, &[], &unpacking.downloads()?)?, unpacking)
    };
    let is_complete = || files().iter().all(|file| checksums::is_there(&folder, file));
    Unpacking::complete(&folder, is_complete, put)?;
    Ok(folder)
}

/// Unpacks the reference's model from a wheel of gymnasium-robotics 1.4.2, and returns its folder,
/// as [`reference_model`] does.
///
/// # Errors
/// As [`reference_model`].
pub fn reference_model_from_wheel(wheel: &Path) -> Result<PathBuf, DownloadError> {
    let folder = folder()?;
    put(&mut Wheel::open(wheel)?, &Unpacking::begin(&folder)?)?;
    Ok(folder)
}

fn folder() -> Result<PathBuf, DownloadError> {
    reference_folder().ok_or(DownloadError::NoCache)
}

fn files() -> Vec<Listed<'static>> {
    contents::parse(FILES).unwrap_or_default()
}

fn put(wheel: &mut Wheel, unpacking: &Unpacking<'_>) -> Result<(), DownloadError> {
    let read = |(name, sha256): Listed<'static>| {
        let bytes = wheel.read_checked(&format!("{FOLDER_IN_WHEEL}/{name}"), sha256)?;
        Ok((name, bytes))
    };
    let files = files().into_iter().map(read).collect::<Result<Vec<_>, _>>()?;
    // The scenes come last, because a model without them is known to be missing.
    files.iter().rev().try_for_each(|(name, bytes)| unpacking.put(name, bytes))
}

#[cfg(test)]
mod tests {
    use super::files;

    #[test]
    fn the_list_has_the_scenes_first() {
        let files = files();
        assert_eq!(files.len(), 25);
        assert!(files[..6].iter().all(|(name, _)| name.ends_with(".xml")), "{files:?}");
    }
}
