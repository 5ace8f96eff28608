//! The MuJoCo that the user has asked for once, so that no variable need name it.

use std::{
    error::Error,
    fmt, fs,
    path::{Path, PathBuf},
    time::SystemTime,
};

use crate::{
    contents::is_complete, folders::name_in_cache, installation::is_version, regular_file,
};

/// A version of MuJoCo in the user's cache that builds and programs of a platform take, unless
/// `MUJOCO_DIR` names another.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Remembered {
    /// The version, such as `3.6.0`.
    pub version: String,
    /// Its folder, which has all the files that were unpacked.
    pub folder: PathBuf,
    /// When it was asked for.
    pub since: SystemTime,
}

/// Error returned when the remembered MuJoCo cannot be used. Builds and programs pass it over.
//
// Implemented by hand: this crate builds at once, without thiserror.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum UnusableChoice {
    /// The file that says which version is remembered says something else.
    Damaged {
        /// The file.
        path: PathBuf,
    },
    /// Files of the remembered version are missing.
    Incomplete {
        /// The version.
        version: String,
        /// Its folder.
        folder: PathBuf,
    },
}

impl fmt::Display for UnusableChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Damaged { path } => write!(
                f,
                "{} does not name a version of MuJoCo: run `fetch-env mujoco` with the version that \
                 you want, or with `system`",
                path.display()
            ),
            Self::Incomplete { version, folder } => write!(
                f,
                "MuJoCo {version} is remembered, but {} does not have all of its files: run \
                 `fetch-env mujoco {version}` to fetch it again, or `fetch-env mujoco system` to \
                 forget it",
                folder.display()
            ),
        }
    }
}

impl Error for UnusableChoice {}

/// What stands for the version in the name of the file that says which MuJoCo is remembered.
pub(crate) const REMEMBERED: &str = "remembered";

/// Returns the file, in the folder `cache`, that says which MuJoCo is remembered for a platform. It
/// is a line with the version, and need not exist.
#[must_use]
pub fn remembering_file(cache: &Path, platform: &str) -> PathBuf {
    cache.join(name_in_cache(REMEMBERED, platform))
}

/// Returns the MuJoCo that is remembered in the folder `cache` for a platform such as
/// `aarch64-linux`; `None` if there is none.
///
/// # Errors
/// [`UnusableChoice`].
pub fn remembered(cache: &Path, platform: &str) -> Result<Option<Remembered>, UnusableChoice> {
    let path = remembering_file(cache, platform);
    let Ok(metadata) = fs::metadata(&path) else { return Ok(None) };
    let text = regular_file::read(&path).ok().and_then(|bytes| String::from_utf8(bytes).ok());
    let version = text.as_deref().and_then(|text| text.strip_suffix('\n'));
    let (Some(version), Ok(since)) = (version.filter(|it| is_version(it)), metadata.modified())
    else {
        return Err(UnusableChoice::Damaged { path });
    };
    let folder = cache.join(name_in_cache(version, platform));
    let is_there = |(name, _): &(&str, &str)| folder.join(name).is_file();
    if !is_complete(&folder, version, is_there) {
        return Err(UnusableChoice::Incomplete { version: version.into(), folder });
    }
    Ok(Some(Remembered { version: version.into(), folder, since }))
}
