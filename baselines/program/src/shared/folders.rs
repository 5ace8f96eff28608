//! What is in folders that the user names.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use anyhow::{Context, ensure};
use baselines::runs::RunFolder;

/// Returns the entries of a folder, sorted by name.
pub fn entries(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let entries = fs::read_dir(folder)
        .with_context(|| format!("cannot read the folder {}", folder.display()))?;
    let mut paths =
        entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>, io::Error>>()?;
    paths.sort();
    Ok(paths)
}

/// Returns the folder, if it has a run, or the folders of runs in it.
pub fn runs_in(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    if RunFolder::is_run(folder) {
        return Ok(vec![folder.to_owned()]);
    }
    let mut runs = entries(folder)?;
    runs.retain(|path| RunFolder::is_run(path));
    ensure!(!runs.is_empty(), "{} has no run: pass a folder of `train`", folder.display());
    Ok(runs)
}
