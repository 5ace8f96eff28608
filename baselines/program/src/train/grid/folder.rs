//! The folder of a grid: its description, its runs, its table and its picture.

use std::path::{Path, PathBuf};

use anyhow::Context;
use baselines::learn::TrainSettings;
use her_relabel::files::read_text;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{super::lock::RunLock, GridError, LIMIT, description::Grid};
use crate::{figures::picture::Picture, shared::json::json_text};

/// The folder of a grid, to which no other process writes.
pub struct GridFolder {
    pub path: PathBuf,
    lock: RunLock,
}

/// The description of the runs in a folder: `grid.json`.
#[derive(PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Begun {
    pub grid: Grid,
    /// The preset's settings, which another version of this program may change.
    pub preset: TrainSettings,
}

const GRID: &str = "grid.json";
const RUNS: &str = "runs";
pub const TABLE: &str = "table.csv";
/// The picture's name, without its extension.
const PICTURE: &str = "success";

impl GridFolder {
    /// Begins a grid in a folder, which is made if there is none, or continues the same grid.
    pub fn open(path: &Path, grid: &Begun) -> anyhow::Result<Self> {
        // This leaves no lock in a folder of something else.
        has_begun(path, grid)?;
        let folder = Self { path: path.to_owned(), lock: RunLock::take(path)? };
        if !has_begun(path, grid)? {
            folder.lock.replace(GRID, json_text(grid)?.as_bytes())?;
        }
        Ok(folder)
    }

    /// Returns the folder of a run.
    pub fn run(&self, choice: &str, seed: u64) -> PathBuf {
        self.path.join(RUNS).join(choice).join(format!("seed-{seed}"))
    }

    pub fn write_table(&self, csv: &str) -> anyhow::Result<()> {
        self.lock.replace(TABLE, csv.as_bytes())
    }

    pub fn write_picture(&self, picture: &Picture) -> anyhow::Result<()> {
        for (ending, bytes) in picture.files() {
            let name = format!("{PICTURE}.{ending}");
            self.lock.replace(&name, bytes)?;
            say!("wrote {}", self.path.join(name).display())?;
        }
        Ok(())
    }
}

/// Returns whether a folder has the runs of a grid, or an error if they are another grid's.
fn has_begun(folder: &Path, grid: &Begun) -> anyhow::Result<bool> {
    let path = folder.join(GRID);
    if !path.exists() {
        let pictures = ["svg", "png"].map(|ending| format!("{PICTURE}.{ending}"));
        let mut ours = [GRID, RUNS, TABLE].into_iter().chain(pictures.iter().map(String::as_str));
        let taken = ours.find(|name| folder.join(name).symlink_metadata().is_ok());
        if let Some(name) = taken {
            return Err(GridError::Taken { path: folder.join(name) }.into());
        }
        return Ok(false);
    }
    let text = read_text(&path, LIMIT);
    let damaged = || format!("{} does not describe a grid: choose another folder", path.display());
    let begun: Value = serde_json::from_str(&text.with_context(damaged)?).with_context(damaged)?;
    let grid = serde_json::from_str(&json_text(grid)?)?;
    match difference(&begun, &grid) {
        Some(difference) => {
            Err(GridError::Changed { folder: folder.to_owned(), difference }.into())
        }
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
