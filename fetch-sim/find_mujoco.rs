//! Finds MuJoCo's headers and library.
//!
//! Both the build script and xtask include this file by its path: xtask looks for MuJoCo where
//! fetch-sim cannot be built, so this needs nothing but the standard library.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

const SYSTEM_PREFIXES: [&str; 2] = ["/usr/local/include", "/usr/include"];

/// Returns the folder of the headers and the path of the library: those of the installation that
/// `MUJOCO_DIR` names, or else the system's, whose library folders the C compiler knows.
///
/// # Errors
/// What is missing.
pub(crate) fn find_mujoco(
    compiler: impl FnOnce() -> Command,
) -> Result<(PathBuf, PathBuf), String> {
    match env::var_os("MUJOCO_DIR") {
        Some(dir) => find_in(Path::new(&dir)),
        None => find_in_system(compiler),
    }
}

fn find_in(dir: &Path) -> Result<(PathBuf, PathBuf), String> {
    let include = dir.join("include");
    if !has_header(&include) {
        return Err(format!(
            "MUJOCO_DIR names {}, which has no include/mujoco/mujoco.h",
            dir.display()
        ));
    }
    let library = [dir.to_path_buf(), dir.join("lib")]
        .iter()
        .find_map(|folder| library_in(folder))
        .ok_or_else(|| format!("MUJOCO_DIR names {}, which has no libmujoco.so", dir.display()))?;
    Ok((include, library))
}

fn find_in_system(compiler: impl FnOnce() -> Command) -> Result<(PathBuf, PathBuf), String> {
    let include = SYSTEM_PREFIXES
        .iter()
        .map(PathBuf::from)
        .find(|folder| has_header(folder))
        .ok_or("MuJoCo's headers were not found")?;
    // The compiler answers with a bare name if it finds no such file.
    let output = compiler()
        .arg("-print-file-name=libmujoco.so")
        .output()
        .or_else(|_| Command::new("cc").arg("-print-file-name=libmujoco.so").output())
        .map_err(|error| format!("the C compiler did not start ({error})"))?;
    let answer = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    let library =
        fs::canonicalize(&answer).map_err(|_| "MuJoCo's library libmujoco.so was not found")?;
    Ok((include, library))
}

fn has_header(include: &Path) -> bool {
    include.join("mujoco/mujoco.h").is_file()
}

/// Returns `libmujoco.so`, or else the newest `libmujoco.so.*`: wheels carry only the latter.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let chosen = fs::read_dir(folder)
        .ok()?
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|path| {
            path.file_name()
                .and_then(|name| name.to_str())
                .is_some_and(|name| name.starts_with("libmujoco.so") || name == "libmujoco.dylib")
        })
        .max_by_key(|path| (path.extension().is_some_and(|end| end == "so"), path.clone()))?;
    fs::canonicalize(chosen).ok()
}
