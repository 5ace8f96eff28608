//! Putting files into a folder: one process at a time, each file whole or not at all. The next
//! process removes what a killed one has left over.

use std::{
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use super::{error::DownloadError, lock_file::LockFile};
use crate::regular_file;

/// Name of the folder for everything unfinished, inside the folder to fill: the file that is being
/// written, and pip's downloads. A file in it is locked while it is in use; if that file is
/// unlocked, a killed process left the rest.
const STAGING: &str = ".fetch-sim-unpacking";
const LOCK: &str = "lock";
const UNFINISHED: &str = "unfinished";
const DOWNLOADS: &str = "downloads";

/// The right to put files into a folder, which only one process has at a time.
pub(super) struct Unpacking<'a> {
    folder: &'a Path,
    /// Whether the folder did not exist.
    is_new: bool,
    staging: PathBuf,
    lock: LockFile,
}

impl<'a> Unpacking<'a> {
    /// Puts files into a folder unless it is complete, and removes what a killed process has left
    /// there.
    pub(super) fn complete(
        folder: &'a Path,
        is_complete: impl Fn() -> bool,
        put: impl FnOnce(&Self) -> Result<(), DownloadError>,
    ) -> Result<(), DownloadError> {
        if is_complete() && !folder.join(STAGING).exists() {
            return Ok(());
        }
        let unpacking = Self::begin(folder)?;
        // Another process may have completed it while this one waited.
        if is_complete() { Ok(()) } else { put(&unpacking) }
    }

    /// Creates a folder if there is none, waits until no other process puts files into it, and
    /// removes what a killed process has left.
    pub(super) fn begin(folder: &'a Path) -> Result<Self, DownloadError> {
        let is_new = !folder.exists();
        let staging = folder.join(STAGING);
        let lock = lock(&staging).map_err(|source| cannot_write(&staging, source))?;
        let unpacking = Self { folder, is_new, staging, lock };
        unpacking.remove_unfinished();
        Ok(unpacking)
    }

    /// Creates a folder for temporary files.
    pub(super) fn downloads(&self) -> Result<PathBuf, DownloadError> {
        let downloads = self.staging.join(DOWNLOADS);
        fs::create_dir(&downloads).map_err(|source| cannot_write(&downloads, source))?;
        Ok(downloads)
    }

    /// Puts a file below the folder, and replaces one with different contents.
    pub(super) fn put(&self, name: &str, bytes: &[u8]) -> Result<(), DownloadError> {
        let is_there = regular_file::read(&self.folder.join(name)).is_ok_and(|it| it == bytes);
        if is_there { Ok(()) } else { self.replace(name, bytes) }
    }

    /// Puts a file below the folder, and replaces whatever has its name.
    pub(super) fn replace(&self, name: &str, bytes: &[u8]) -> Result<(), DownloadError> {
        let path = self.folder.join(name);
        let unfinished = self.staging.join(UNFINISHED);
        let made = path.parent().map_or(Ok(()), fs::create_dir_all);
        made.and_then(|()| fs::write(&unfinished, bytes))
            .and_then(|()| fs::rename(&unfinished, &path))
            .map_err(|source| cannot_write(&path, source))
    }

    /// If this fails, the next process tries again.
    fn remove_unfinished(&self) {
        let _ = fs::remove_file(self.staging.join(UNFINISHED));
        let _ = fs::remove_dir_all(self.staging.join(DOWNLOADS));
    }
}

impl Drop for Unpacking<'_> {
    fn drop(&mut self) {
        self.remove_unfinished();
        self.lock.remove(&self.staging.join(LOCK));
        // Folders with anything in them stay.
        let _ = fs::remove_dir(&self.staging);
        if self.is_new {
            let _ = fs::remove_dir(self.folder);
        }
    }
}

/// Creates the folder of unfinished files, unless it is there, and waits for its lock.
fn lock(staging: &Path) -> io::Result<LockFile> {
    let path = staging.join(LOCK);
    loop {
        match fs::create_dir_all(staging) {
            // It was there, and another process has removed it since.
            Err(error)
                if error.kind() == ErrorKind::AlreadyExists
                    && staging.parent().is_some_and(Path::is_dir) => {}
            made => made?,
        }
        let locked = match fs::symlink_metadata(staging) {
            Ok(metadata) if !metadata.is_dir() => return Err(ErrorKind::NotADirectory.into()),
            Ok(_) => LockFile::lock(&path),
            Err(error) => Err(error),
        };
        match locked {
            Ok(Some(lock)) => return Ok(lock),
            // The process that held the lock removed the file, or the folder, when it was done.
            Ok(None) => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            Err(error) => return Err(error),
        }
    }
}

fn cannot_write(path: &Path, source: io::Error) -> DownloadError {
    DownloadError::Write { path: path.into(), source }
}
