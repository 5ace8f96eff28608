//! The files of MuJoCo's library in an installation.

use std::{
    fs,
    path::{Path, PathBuf},
};

/// Returns the libraries of an installation: the file itself, or those in the folder and its `lib`.
#[must_use]
pub fn libraries_of(installation: &Path) -> Vec<PathBuf> {
    if installation.is_file() {
        return vec![installation.to_path_buf()];
    }
    let mut libraries = libraries_in(installation);
    libraries.extend(libraries_in(&installation.join("lib")));
    libraries
}

/// Returns the libraries in a folder: the one without a version in its name, then the newest first.
#[must_use]
pub fn libraries_in(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut libraries: Vec<_> = entries
        .filter_map(|entry| {
            let path = entry.ok()?.path();
            Some((version_in_name(path.file_name()?.to_str()?)?, path))
        })
        .filter(|(_, path)| path.is_file())
        .collect();
    libraries.sort_by(|(a, _), (b, _)| b.is_empty().cmp(&a.is_empty()).then_with(|| b.cmp(a)));
    libraries.into_iter().map(|(_, path)| path).collect()
}

/// Returns the version numbers in a library's file name, empty for the plain name; `None` for other
/// files.
#[must_use]
pub fn version_in_name(name: &str) -> Option<Vec<u32>> {
    if name == "mujoco.dll" {
        return Some(Vec::new());
    }
    let version = match name.strip_prefix("libmujoco.")? {
        "so" | "dylib" => return Some(Vec::new()),
        rest => rest.strip_prefix("so.").or_else(|| rest.strip_suffix(".dylib"))?,
    };
    version.split('.').map(|number| number.parse().ok()).collect()
}

/// Returns whether a text is a version of MuJoCo: three numbers, such as `3.6.0`.
pub(crate) fn is_version(text: &str) -> bool {
    let is_number = |number: &str| number.parse::<u16>().is_ok() && !number.starts_with('+');
    text.split('.').count() == 3 && text.split('.').all(is_number)
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{is_version, libraries_in, libraries_of};

    #[test]
    fn a_version_has_three_numbers() {
        for wrong in ["", "3.6", "3.6.0.1", "3.6.x", "3.6.+0", "../3.6.0", "3.6.0 "] {
            assert!(!is_version(wrong), "{wrong}");
        }
        assert!(is_version("3.6.0") && is_version("3.17.12"));
    }

    #[test]
    fn the_plain_name_comes_first_and_then_the_newest_version() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        for name in [
            "libmujoco.so.3.6.0",
            "libmujoco.so.3.10.0",
            "libmujoco.so.3.10",
            "libmujoco.sock",
            "libmujoco.so.old",
            "libmujoco_simulate.so",
            "libmujoco.3.17.0.dylib",
        ] {
            fs::write(folder.path().join(name), "")?;
        }
        fs::create_dir(folder.path().join("libmujoco.so.9.0.0"))?;
        let names = || -> Vec<_> {
            let libraries = libraries_in(folder.path());
            libraries.iter().filter_map(|path| Some(path.file_name()?.to_owned())).collect()
        };
        let versioned = [
            "libmujoco.3.17.0.dylib",
            "libmujoco.so.3.10.0",
            "libmujoco.so.3.10",
            "libmujoco.so.3.6.0",
        ];
        assert_eq!(names(), versioned);
        fs::write(folder.path().join("libmujoco.so"), "")?;
        assert_eq!(names()[0], "libmujoco.so");
        assert_eq!(names()[1..], versioned);
        Ok(())
    }

    #[test]
    fn an_installation_is_a_folder_or_a_file() -> std::io::Result<()> {
        let folder = tempfile::tempdir()?;
        assert!(libraries_of(folder.path()).is_empty());
        fs::create_dir(folder.path().join("lib"))?;
        let library = folder.path().join("lib/libmujoco.so");
        fs::write(&library, "")?;
        assert_eq!(libraries_of(folder.path()), std::slice::from_ref(&library));
        assert_eq!(libraries_of(&library), [library]);
        Ok(())
    }
}
