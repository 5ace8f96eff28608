//! Python wheels: fetched by pip, unpacked file by file, and only as a whole.

use std::{
    fs::{self, File},
    io::{self, Read},
    path::{Path, PathBuf},
    process::Command,
};

use hmac_sha256::Hash;
use zip::ZipArchive;

use super::error::FetchError;

pub(super) struct Wheel {
    path: PathBuf,
    archive: ZipArchive<File>,
}

impl Wheel {
    /// Opens the wheel at a path, or else fetches one of a requirement such as `mujoco==3.6.0`.
    pub(super) fn open_or_fetch(
        path: Option<&Path>,
        requirement: &str,
    ) -> Result<Self, FetchError> {
        path.map_or_else(|| Self::fetch(requirement), Self::open)
    }

    /// Downloads a wheel by pip, which knows the user's index, mirror, proxy and certificates.
    fn fetch(requirement: &str) -> Result<Self, FetchError> {
        let error = |reason: String| FetchError::Pip { requirement: requirement.into(), reason };
        let into = tempfile::tempdir().map_err(|e| cannot_write(&std::env::temp_dir(), e))?;
        let output = Command::new("python3")
            .args(["-m", "pip", "download", "--quiet", "--disable-pip-version-check"])
            .args(["--no-deps", "--only-binary=:all:", "--dest"])
            .arg(into.path())
            .arg(requirement)
            .output()
            .map_err(|e| error(format!("python3 did not start, {e}; install Python 3 with pip")))?;
        if !output.status.success() {
            return Err(error(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
        }
        let wheel = fs::read_dir(into.path())
            .map_err(|e| cannot_write(into.path(), e))?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
            .ok_or_else(|| error("it wrote no wheel".into()))?;
        Self::open(&wheel) // stays open when the folder is removed
    }

    fn open(path: &Path) -> Result<Self, FetchError> {
        let error = |reason: String| FetchError::Wheel { path: path.into(), reason };
        let file = File::open(path).map_err(|e| error(format!("it cannot be read: {e}")))?;
        let archive = ZipArchive::new(file).map_err(|e| error(e.to_string()))?;
        Ok(Self { path: path.into(), archive })
    }

    /// Returns the contents of a file, checked against the archive's own checksum.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, FetchError> {
        let mut bytes = Vec::new();
        let result = match self.archive.by_name(name) {
            Ok(mut file) => {
                file.read_to_end(&mut bytes).map_err(|e| format!("{name} is damaged: {e}"))
            }
            Err(_) => Err(format!("it has no file {name}")),
        };
        result.map(|_| bytes).map_err(|reason| self.error(reason))
    }

    /// Returns the error that the wheel is not usable for a reason.
    pub(super) fn error(&self, reason: String) -> FetchError {
        FetchError::Wheel { path: self.path.clone(), reason }
    }
}

/// Fails unless the bytes have this SHA-256, in hexadecimal.
pub(super) fn check_sha256(name: &str, bytes: &[u8], expected: &str) -> Result<(), FetchError> {
    let found = hexadecimal(&Hash::hash(bytes));
    if found == expected {
        return Ok(());
    }
    Err(FetchError::Checksum { name: name.into(), found, expected: expected.into() })
}

pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Makes a folder whole or not at all: `fill` writes into a new folder beside it, which then
/// replaces it.
pub(super) fn replace_folder(
    folder: &Path,
    fill: impl FnOnce(&Path) -> Result<(), FetchError>,
) -> Result<(), FetchError> {
    let error = |source| cannot_write(folder, source);
    let parent = folder.parent().ok_or_else(|| error(io::ErrorKind::InvalidInput.into()))?;
    fs::create_dir_all(parent).map_err(error)?;
    // Removed on drop, so an interruption leaves at most a hidden folder that nothing looks at.
    let staging =
        tempfile::Builder::new().prefix(".unpacking-").tempdir_in(parent).map_err(error)?;
    let new = staging.path().join("new");
    fs::create_dir(&new).map_err(error)?;
    fill(&new)?;
    if folder.exists() {
        fs::rename(folder, staging.path().join("old")).map_err(error)?;
    }
    fs::rename(&new, folder).map_err(error)
}

/// Writes a file below a folder, making the folders on the way.
pub(super) fn write(folder: &Path, name: &str, bytes: &[u8]) -> Result<(), FetchError> {
    let path = folder.join(name);
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    made.and_then(|()| fs::write(&path, bytes)).map_err(|source| cannot_write(&path, source))
}

fn cannot_write(path: &Path, source: io::Error) -> FetchError {
    FetchError::Write { path: path.into(), source }
}
