//! What a version of MuJoCo consists of, once it is unpacked.

use std::path::Path;

use crate::{installation::version_in_name, regular_file};

/// The list of the files that were unpacked, which is written last.
pub(crate) const LIST: &str = "SHA256SUMS";

/// The name of a file and its SHA-256, in hexadecimal.
pub(crate) type Listed<'a> = (&'a str, &'a str);

/// Returns the files of a list as `sha256sum` writes it; `None` if it is damaged.
pub(crate) fn parse(list: &str) -> Option<Vec<Listed<'_>>> {
    list.lines().map(|line| line.split_once("  ").map(|(sha256, name)| (name, sha256))).collect()
}

/// Returns whether a folder has all files of a version of MuJoCo, each of which passes a check.
pub(crate) fn is_complete(
    folder: &Path,
    version: &str,
    passes: impl Fn(&Listed<'_>) -> bool,
) -> bool {
    let list = regular_file::read(&folder.join(LIST)).unwrap_or_default();
    let list = String::from_utf8_lossy(&list);
    parse(&list).is_some_and(|files| {
        let names = files.iter().map(|(name, _)| *name);
        missing(names, version).is_none() && files.iter().all(passes)
    })
}

/// Returns what an installation with files of these names lacks.
pub(crate) fn missing<'a>(
    names: impl Iterator<Item = &'a str> + Clone,
    version: &str,
) -> Option<String> {
    // Windows has no versions in the names of libraries.
    let is_library = |name: &str| {
        version_in_name(name).is_some() && (name.contains(version) || name.ends_with(".dll"))
    };
    if !names.clone().any(|name| name == "include/mujoco/mujoco.h") {
        return Some("headers".into());
    }
    if !names.clone().any(is_library) {
        return Some(format!("library of MuJoCo {version}"));
    }
    None
}
