//! The folder of a run, and its files.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::curve::{CurveLine, curve_csv, read_csv};
use super::description::{RUN, RunDescription};
use super::error::FolderError;
use super::lock::{LOCK, RunLock};
use crate::learn::{CurveRow, checkpoints};
use crate::trained::{AnyPolicy, TrainedPolicy};

const CURVE: &str = "curve.csv";
const POLICY: &str = "policy.safetensors";
const PAGE: &str = "page.html";
const TEACHER: &str = "teacher.safetensors";

/// The folder of a run: `run.json`, `curve.csv`, the last two checkpoints, and after its end
/// `policy.safetensors` and `page.html`. A run with a policy as its teacher has it from its beginning,
/// as `teacher.safetensors`.
///
/// One process at a time writes there: a lock, `run.lock`, holds off others until this value is
/// dropped or the process ends. Everything else in the folder is the user's, and stays.
#[derive(Debug)]
pub struct RunFolder {
    path: PathBuf,
    description: RunDescription,
    /// Held where files are written: in the first process.
    lock: Option<RunLock>,
}

/// Returns the files that a run has written in a folder, beside its description and its lock: those
/// that a resumed run writes again, then the checkpoints, oldest first, and its teacher, with which
/// they are resumed.
fn written(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let existing = |name| Some(folder.join(name)).filter(|path| exists(path));
    let mut paths: Vec<_> = [PAGE, POLICY, CURVE].into_iter().filter_map(existing).collect();
    paths.extend(checkpoints_in(folder)?);
    paths.extend(existing(TEACHER));
    Ok(paths)
}

fn checkpoints_in(folder: &Path) -> Result<Vec<PathBuf>, FolderError> {
    checkpoints(folder).map_err(FolderError::file("read", folder))
}

/// Whether a path exists, even as a link to nothing.
fn exists(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}

impl RunFolder {
    /// Checks that a new run may begin in a folder, and changes nothing there.
    ///
    /// # Errors
    /// [`FolderError::HasRun`] unless `overwrite` is set, and [`FolderError`] if the folder has
    /// files with the names of a run's that may not belong to one.
    pub fn check_free(path: impl AsRef<Path>, overwrite: bool) -> Result<(), FolderError> {
        let folder = path.as_ref();
        let written = written(folder)?;
        if exists(&folder.join(RUN)) {
            // The `run.json` of another program stays.
            RunDescription::read(folder)?;
            // A start that was killed leaves only a description and the teacher.
            if overwrite || written.iter().all(|path| path.ends_with(TEACHER)) {
                return Ok(());
            }
            let has_checkpoint = Self::has_checkpoint(folder)?;
            return Err(FolderError::HasRun { folder: folder.to_owned(), has_checkpoint });
        }
        if let Some(path) = written.into_iter().next() {
            return Err(FolderError::Taken { path, description: RUN });
        }
        let mut others = fs::read_dir(folder).into_iter().flatten().flatten();
        if overwrite && !others.all(|entry| entry.file_name() == LOCK) {
            return Err(FolderError::NotOverwritten { folder: folder.to_owned() });
        }
        Ok(())
    }

    /// Begins a run in a folder, which is made if there is none, and removes what the run before it
    /// wrote. If this process is killed, the old run can be resumed until its last checkpoint is
    /// removed, and after that a new run can be started.
    ///
    /// # Errors
    /// As [`check_free`](Self::check_free), and [`FolderError`] if another process writes there, or
    /// the file system fails.
    pub fn create(
        path: impl AsRef<Path>,
        description: RunDescription,
        overwrite: bool,
    ) -> Result<Self, FolderError> {
        let path = path.as_ref();
        let lock = RunLock::take(path)?;
        Self::check_free(path, overwrite)?;
        for path in written(path)? {
            remove(&path)?;
        }
        lock.replace(
            RUN,
            json_text(&description).map_err(FolderError::file("write", path))?.as_bytes(),
        )?;
        Ok(Self { path: path.to_owned(), description, lock: Some(lock) })
    }

    /// Opens the folder of a run to resume it.
    ///
    /// # Errors
    /// [`FolderError`] if there is no run with a checkpoint, or another process writes there.
    pub fn resume(path: impl AsRef<Path>) -> Result<Self, FolderError> {
        let path = path.as_ref();
        // This leaves no lock in a folder without a run.
        RunDescription::read(path)?;
        let lock = RunLock::take(path)?;
        let folder = Self { lock: Some(lock), ..Self::open(path)? };
        if checkpoints_in(path)?.is_empty() {
            return Err(FolderError::NoCheckpoint { folder: path.to_owned() });
        }
        Ok(folder)
    }

    /// Opens the folder of a run to read it.
    ///
    /// # Errors
    /// [`FolderError::NotARun`] and [`FolderError::Damaged`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, FolderError> {
        let path = path.as_ref();
        Ok(Self::of_other(path, RunDescription::read(path)?))
    }

    /// Returns the folder of a run whose files another process writes.
    pub(super) fn of_other(path: &Path, description: RunDescription) -> Self {
        Self { path: path.to_owned(), description, lock: None }
    }

    /// Whether a folder is the folder of a run.
    #[must_use]
    pub fn is_run(path: impl AsRef<Path>) -> bool {
        path.as_ref().join(RUN).is_file()
    }

    /// Whether the run in a folder can be resumed.
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be read.
    pub fn has_checkpoint(path: impl AsRef<Path>) -> Result<bool, FolderError> {
        let path = path.as_ref();
        Ok(Self::is_run(path) && !checkpoints_in(path)?.is_empty())
    }

    /// Whether the run in a folder has ended and [has no checkpoints](Self::remove_checkpoints):
    /// one with checkpoints can be continued, which ends it again in the same way.
    ///
    /// # Errors
    /// [`FolderError`] if the folder cannot be read.
    pub fn is_finished(path: impl AsRef<Path>) -> Result<bool, FolderError> {
        let path = path.as_ref();
        let has = |name| path.join(name).is_file();
        Ok(has(RUN) && has(POLICY) && has(CURVE) && checkpoints_in(path)?.is_empty())
    }

    /// Returns the path.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the description of the run.
    #[must_use]
    pub const fn description(&self) -> &RunDescription {
        &self.description
    }

    /// Whether the file system has no locks, so that nothing holds off other processes.
    #[must_use]
    pub fn is_shared(&self) -> bool {
        self.lock.as_ref().is_some_and(|lock| !lock.is_exclusive())
    }

    /// Removes the checkpoints of a run that will not be resumed.
    ///
    /// # Errors
    /// [`FolderError`] if the file system fails.
    pub fn remove_checkpoints(&self) -> Result<(), FolderError> {
        checkpoints_in(&self.path)?.iter().try_for_each(|path| remove(path))
    }

    fn write(&self, name: &str, bytes: &[u8]) -> Result<(), FolderError> {
        let read_only = || FolderError::ReadOnly { folder: self.path.clone() };
        self.lock.as_ref().ok_or_else(read_only)?.replace(name, bytes)
    }

    /// Writes the curve so far: `curve.csv`.
    ///
    /// # Errors
    /// [`FolderError`] if another process writes the files, or the file system fails.
    pub fn write_curve(&self, rows: &[CurveRow]) -> Result<(), FolderError> {
        let csv = curve_csv(rows).map_err(FolderError::file("write", &self.path.join(CURVE)))?;
        self.write(CURVE, &csv)
    }

    /// Reads the curve.
    ///
    /// # Errors
    /// [`FolderError`] if the file cannot be read, or is not a curve.
    pub fn read_curve(&self) -> Result<Vec<CurveLine>, FolderError> {
        read_csv(&self.path.join(CURVE))
    }

    /// Writes the policy: `policy.safetensors`.
    ///
    /// # Errors
    /// As [`write_curve`](Self::write_curve).
    pub fn write_policy(&self, policy: &AnyPolicy) -> Result<(), FolderError> {
        self.write(POLICY, &policy.to_bytes()?)
    }

    /// Reads the policy.
    ///
    /// # Errors
    /// [`FolderError`] if the file cannot be read, or is not a policy.
    pub fn read_policy(&self) -> Result<AnyPolicy, FolderError> {
        Ok(AnyPolicy::load(self.path.join(POLICY))?)
    }

    /// Writes the teacher: `teacher.safetensors`.
    pub(super) fn write_teacher(&self, policy: &TrainedPolicy) -> Result<(), FolderError> {
        self.write(TEACHER, &policy.to_bytes()?)
    }

    /// Reads the teacher.
    pub(super) fn read_teacher(&self) -> Result<TrainedPolicy, FolderError> {
        Ok(TrainedPolicy::load(self.path.join(TEACHER))?)
    }

    /// Writes the page: `page.html`.
    ///
    /// # Errors
    /// As [`write_curve`](Self::write_curve).
    pub fn write_page(&self, html: &str) -> Result<(), FolderError> {
        self.write(PAGE, html.as_bytes())
    }
}

fn remove(path: &Path) -> Result<(), FolderError> {
    fs::remove_file(path).map_err(FolderError::file("remove", path))
}

/// Returns a value as lines of JSON.
pub(super) fn json_text(value: &impl Serialize) -> io::Result<String> {
    Ok(serde_json::to_string_pretty(value)? + "\n")
}
