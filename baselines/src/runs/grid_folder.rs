//! The folder of a grid: its description, its runs, its table and its picture.

use std::path::{Path, PathBuf};

use her_relabel::files::read_text;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::description::LIMIT;
use super::error::{FolderError, GridError};
use super::folder::json_text;
use super::grid::Grid;
use super::lock::RunLock;
use super::table::GridTable;
use crate::learn::TrainSettings;

const GRID: &str = "grid.json";
const RUNS: &str = "runs";
const TABLE: &str = "table.csv";
/// The files of the picture.
const PICTURES: [&str; 2] = ["success.svg", "success.png"];

/// The folder of a grid, to which no other process writes until this value is dropped.
#[derive(Debug)]
pub struct GridFolder {
    path: PathBuf,
    lock: RunLock,
}

/// The description of the runs in a folder: `grid.json`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Begun {
    grid: Grid,
    /// The preset's settings, which another version of this crate may change.
    preset: TrainSettings,
}

impl GridFolder {
    /// Begins a grid in a folder, which is made if there is none, or continues the same grid.
    /// `preset` are the settings that it starts from.
    ///
    /// # Errors
    /// [`GridError::Changed`] if the folder has another grid, and [`GridError`] if it has files with
    /// the names of a grid's, another process writes there, or the file system fails.
    pub fn open(
        path: impl AsRef<Path>,
        grid: &Grid,
        preset: &TrainSettings,
    ) -> Result<Self, GridError> {
        let path = path.as_ref();
        let begun = json_text(&Begun { grid: grid.clone(), preset: preset.clone() })
            .map_err(FolderError::file("write", &path.join(GRID)))?;
        // This leaves no lock in a folder of something else.
        has_begun(path, &begun)?;
        let folder = Self { path: path.to_owned(), lock: RunLock::take(path)? };
        if !has_begun(path, &begun)? {
            folder.lock.replace(GRID, begun.as_bytes())?;
        }
        Ok(folder)
    }

    /// Whether the file system has no locks, so that nothing holds off other processes.
    #[must_use]
    pub const fn is_shared(&self) -> bool {
        !self.lock.is_exclusive()
    }

    /// Returns the folder of a run.
    pub(super) fn run(&self, choice: &str, seed: u64) -> PathBuf {
        self.path.join(RUNS).join(choice).join(format!("seed-{seed}"))
    }

    /// Writes the table, `table.csv`, and returns its path.
    ///
    /// # Errors
    /// [`FolderError`] if the file system fails.
    pub fn write_table(&self, table: &GridTable) -> Result<PathBuf, FolderError> {
        let path = self.path.join(TABLE);
        let csv = table.csv().map_err(FolderError::file("write", &path))?;
        self.lock.replace(TABLE, &csv)?;
        Ok(path)
    }

    /// Writes the picture, `success.svg` and `success.png`, and returns their paths.
    ///
    /// # Errors
    /// [`FolderError`] if the file system fails.
    pub fn write_picture(&self, svg: &[u8], png: &[u8]) -> Result<[PathBuf; 2], FolderError> {
        for (name, bytes) in PICTURES.into_iter().zip([svg, png]) {
            self.lock.replace(name, bytes)?;
        }
        Ok(PICTURES.map(|name| self.path.join(name)))
    }
}

/// Returns whether a folder has the runs of a grid, or an error if they are another grid's.
fn has_begun(folder: &Path, grid: &str) -> Result<bool, GridError> {
    let path = folder.join(GRID);
    if !path.exists() {
        let mut ours = [GRID, RUNS, TABLE].into_iter().chain(PICTURES);
        let taken = ours.find(|name| folder.join(name).symlink_metadata().is_ok());
        return match taken {
            Some(name) => {
                Err(FolderError::Taken { path: folder.join(name), description: GRID }.into())
            }
            None => Ok(false),
        };
    }
    let text = read_text(&path, LIMIT).map_err(FolderError::file("read", &path))?;
    let begun: Value = serde_json::from_str(&text)
        .map_err(|source| GridError::Damaged { path: path.clone(), source })?;
    match difference(&begun, &serde_json::from_str(grid)?) {
        Some(difference) => Err(GridError::Changed { folder: folder.to_owned(), difference }),
        None => Ok(true),
    }
}

/// Returns the first place in which two values differ, such as `grid.seeds`.
fn difference(first: &Value, second: &Value) -> Option<String> {
    if first == second {
        return None;
    }
    let (Some(firsts), Some(seconds)) = (first.as_object(), second.as_object()) else {
        return Some("its value".to_owned());
    };
    let keys = firsts.keys().chain(seconds.keys());
    keys.filter_map(|key| match (firsts.get(key), seconds.get(key)) {
        (Some(first), Some(second)) if first.is_object() && second.is_object() => {
            difference(first, second).map(|rest| format!("{key}.{rest}"))
        }
        (first, second) => (first != second).then(|| key.clone()),
    })
    .next()
}
