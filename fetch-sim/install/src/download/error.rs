//! Errors of downloading.

use std::{error::Error, fmt, io, path::PathBuf};

/// Error returned when a download, or the wheel given in its place, cannot be used.
//
// Implemented by hand: this crate builds at once, without thiserror.
#[derive(Debug)]
#[non_exhaustive]
pub enum DownloadError {
    /// The user has no home, and so no cache.
    NoCache,
    /// The text is not a version of MuJoCo.
    Version {
        /// The text.
        version: String,
    },
    /// MuJoCo has no wheels for the platform.
    Platform {
        /// Its name.
        platform: String,
        /// The names of the platforms that have wheels.
        known: Vec<&'static str>,
    },
    /// Python's pip could not download a package.
    Pip {
        /// The package and its version, such as `mujoco==3.6.0`.
        requirement: String,
        /// pip's message.
        reason: String,
    },
    /// A wheel is damaged or the wrong one, or a file in it is not the published one.
    Wheel {
        /// The wheel.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// A file or folder could not be written.
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl fmt::Display for DownloadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoCache => {
                write!(
                    f,
                    "the user has no home: set XDG_CACHE_HOME, or FETCH_ASSETS_DIR for the model"
                )
            }
            Self::Version { version } => {
                write!(
                    f,
                    "{version:?} is not a version of MuJoCo: give three numbers, such as 3.6.0"
                )
            }
            Self::Platform { platform, known } => {
                write!(f, "MuJoCo has no wheels for {platform:?}: use one of {}", known.join(", "))
            }
            Self::Pip { requirement, reason } => write!(
                f,
                "pip could not download {requirement} ({reason}): try again, or pass the wheel's \
                 file"
            ),
            Self::Wheel { path, reason } => {
                write!(f, "{} is not the right wheel ({reason}): download it again", path.display())
            }
            Self::Write { path, source } => {
                write!(
                    f,
                    "{} cannot be written ({source}): free some space, or change its permissions",
                    path.display()
                )
            }
        }
    }
}

impl Error for DownloadError {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        match self {
            Self::Write { source, .. } => Some(source),
            _ => None,
        }
    }
}
