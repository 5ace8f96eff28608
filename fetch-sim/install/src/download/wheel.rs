//! Python wheels: fetched by pip, and read file by file.

use std::{
    fs::{self, File},
    io::Read,
    path::{Path, PathBuf},
    process::Command,
};

use zip::ZipArchive;

use super::{checksums, error::DownloadError};

/// The command that starts Python.
const PYTHON: &str = if cfg!(windows) { "python" } else { "python3" };

/// Returns a command that starts Python. It does not look for modules in the current directory,
/// where anybody may have put a `pip.py`; Pythons before 3.11 do.
pub(super) fn python() -> Command {
    let mut python = Command::new(PYTHON);
    python.env("PYTHONSAFEPATH", "1");
    python
}

pub(super) struct Wheel {
    path: PathBuf,
    archive: ZipArchive<File>,
}

impl Wheel {
    /// Downloads the wheel of a requirement such as `mujoco==3.6.0` into a folder with pip, which
    /// knows the user's index, mirror, proxy and certificates. Additional arguments of pip may
    /// select one of the wheels.
    pub(super) fn fetch(
        requirement: &str,
        which: &[String],
        into: &Path,
    ) -> Result<Self, DownloadError> {
        let error = |reason: String| DownloadError::Pip { requirement: requirement.into(), reason };
        let output = python()
            .args(["-m", "pip", "download", "--quiet", "--disable-pip-version-check"])
            .args(["--no-deps", "--only-binary=:all:", "--dest"])
            .arg(into)
            .args(which)
            .arg(requirement)
            .env(if cfg!(windows) { "TEMP" } else { "TMPDIR" }, into)
            .output()
            .map_err(|e| {
                error(format!("{PYTHON} did not start, {e}; install Python 3 with pip"))
            })?;
        if !output.status.success() {
            return Err(error(String::from_utf8_lossy(&output.stderr).trim().to_owned()));
        }
        let wheel = fs::read_dir(into)
            .map_err(|e| error(e.to_string()))?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .find(|path| path.extension().is_some_and(|extension| extension == "whl"))
            .ok_or_else(|| error("it wrote no wheel".into()))?;
        Self::open(&wheel)
    }

    /// Opens the wheel at a path.
    pub(super) fn open(path: &Path) -> Result<Self, DownloadError> {
        let error = |reason: String| DownloadError::Wheel { path: path.into(), reason };
        let file = File::open(path).map_err(|e| error(format!("it cannot be read: {e}")))?;
        let archive = ZipArchive::new(file).map_err(|e| error(e.to_string()))?;
        Ok(Self { path: path.into(), archive })
    }

    /// Returns the contents of a file, checked against the archive's own checksum.
    pub(super) fn read(&mut self, name: &str) -> Result<Vec<u8>, DownloadError> {
        let mut bytes = Vec::new();
        let result = match self.archive.by_name(name) {
            Ok(mut file) => {
                file.read_to_end(&mut bytes).map_err(|e| format!("{name} is damaged: {e}"))
            }
            Err(_) => Err(format!("it has no file {name}")),
        };
        result.map(|_| bytes).map_err(|reason| self.error(reason))
    }

    /// Returns the contents of a file that has this SHA-256.
    pub(super) fn read_checked(
        &mut self,
        name: &str,
        sha256: &str,
    ) -> Result<Vec<u8>, DownloadError> {
        let bytes = self.read(name)?;
        checksums::check(name, &bytes, sha256).map_err(|reason| self.error(reason))?;
        Ok(bytes)
    }

    /// Returns the error of a wheel that cannot be used for this reason.
    pub(super) fn error(&self, reason: String) -> DownloadError {
        DownloadError::Wheel { path: self.path.clone(), reason }
    }
}
