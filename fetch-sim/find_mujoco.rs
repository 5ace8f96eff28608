//! Finds MuJoCo's headers and library for a build.
//!
//! Both the build script and xtask include this file by its path: xtask looks for MuJoCo where
//! fetch-sim has none, so this needs only the standard library.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::installation::{NONE, libraries_of, mujoco_dir};

/// Folders of the system's headers.
pub(crate) const SYSTEM_PREFIXES: [&str; 2] = ["/usr/local/include", "/usr/include"];

/// The parts of MuJoCo that a build needs.
#[derive(Debug)]
#[allow(dead_code, reason = "xtask only asks whether there is one")]
pub(crate) struct Found {
    /// Folder of `mujoco/mujoco.h`.
    pub(crate) include: PathBuf,
    /// The library, for which programs also look elsewhere.
    pub(crate) library: Option<PathBuf>,
}

/// Returns the installation that `MUJOCO_DIR` names, or else the system's, whose library folders
/// the C compiler knows; `None` if there is none.
///
/// # Errors
/// If `MUJOCO_DIR` names something else: a build without MuJoCo would hide the mistake.
pub(crate) fn find_mujoco(compiler: impl FnOnce() -> Command) -> Result<Option<Found>, String> {
    match mujoco_dir() {
        Some(dir) if dir.as_os_str() == NONE => Ok(None),
        Some(dir) => find_in(&dir).map(Some),
        None => Ok(find_in_system(compiler)),
    }
}

fn find_in(dir: &Path) -> Result<Found, String> {
    let names = format!("MUJOCO_DIR names {}", dir.display());
    // The folders around a file are those of its installation.
    let (skipped, taken) = if dir.is_file() { (1, 2) } else { (0, 1) };
    let folders = dir.ancestors().skip(skipped).take(taken);
    let include = folders
        .map(|folder| folder.join("include"))
        .find(|include| has_header(include))
        .ok_or_else(|| format!("{names}, which has no include/mujoco/mujoco.h"))?;
    let library = libraries_of(dir)
        .into_iter()
        .find_map(|library| fs::canonicalize(library).ok())
        .ok_or_else(|| format!("{names}, which has no libmujoco.so"))?;
    Ok(Found { include, library: Some(library) })
}

fn find_in_system(compiler: impl FnOnce() -> Command) -> Option<Found> {
    let include = SYSTEM_PREFIXES.iter().map(PathBuf::from).find(|folder| has_header(folder))?;
    // The compiler answers with a bare name if it finds no such file.
    let output = compiler()
        .arg("-print-file-name=libmujoco.so")
        .output()
        .or_else(|_| Command::new("cc").arg("-print-file-name=libmujoco.so").output());
    let answer =
        output.ok().map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    let library = answer.and_then(|answer| fs::canonicalize(answer).ok());
    Some(Found { include, library })
}

fn has_header(include: &Path) -> bool {
    include.join("mujoco/mujoco.h").is_file()
}
