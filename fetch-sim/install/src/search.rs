//! Finding MuJoCo's headers and library for a build.

use std::{
    error::Error,
    fmt, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    folders::{NONE, mujoco_dir},
    installation::libraries_of,
};

/// Folders of the system's headers.
pub const SYSTEM_PREFIXES: [&str; 2] = ["/usr/local/include", "/usr/include"];

/// The parts of MuJoCo that a build needs.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Found {
    /// Folder of `mujoco/mujoco.h`.
    pub include: PathBuf,
    /// The library, for which programs also look elsewhere.
    pub library: Option<PathBuf>,
}

/// Error returned when `MUJOCO_DIR` does not name an installation of MuJoCo.
//
// Implemented by hand: this crate builds at once, without thiserror.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotMujoco {
    /// The value of the variable.
    pub value: PathBuf,
    /// What it lacks.
    pub missing: &'static str,
}

impl fmt::Display for NotMujoco {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MUJOCO_DIR names {}, which has no {}", self.value.display(), self.missing)
    }
}

impl Error for NotMujoco {}

/// Returns the installation that `MUJOCO_DIR` names, or else the system's, whose library folders
/// the C compiler knows; `None` if there is none.
///
/// # Errors
/// [`NotMujoco`] if `MUJOCO_DIR` names something else: a build without MuJoCo would hide the
/// mistake.
pub fn find_mujoco(compiler: impl FnOnce() -> Command) -> Result<Option<Found>, NotMujoco> {
    match mujoco_dir() {
        Some(dir) if dir.as_os_str() == NONE => Ok(None),
        Some(dir) => find_in(&dir).map(Some),
        None => Ok(find_in_system(compiler)),
    }
}

fn find_in(dir: &Path) -> Result<Found, NotMujoco> {
    let lacks = |missing| NotMujoco { value: dir.into(), missing };
    // The folders around a file are those of its installation.
    let (skipped, taken) = if dir.is_file() { (1, 2) } else { (0, 1) };
    let folders = dir.ancestors().skip(skipped).take(taken);
    let include = folders
        .map(|folder| folder.join("include"))
        .find(|include| has_header(include))
        .ok_or_else(|| lacks("include/mujoco/mujoco.h"))?;
    let library = libraries_of(dir)
        .into_iter()
        .find_map(|library| fs::canonicalize(library).ok())
        .ok_or_else(|| lacks("libmujoco.so"))?;
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
