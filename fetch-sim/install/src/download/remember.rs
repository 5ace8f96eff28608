//! Remembering a MuJoCo, so that builds and programs take it without a variable that names it.

use std::{
    fs,
    io::{self, ErrorKind},
    path::{Path, PathBuf},
};

use super::{error::DownloadError, mujoco::mujoco, unpacking::Unpacking};
use crate::{
    folders::{cache_folder, name_in_cache, own_platform},
    remembered::{REMEMBERED, remembering_file},
};

/// Downloads a version of MuJoCo as [`mujoco`] does, and remembers it for the platform of this
/// program: builds and programs take it from then on, unless `MUJOCO_DIR` names another. It replaces
/// the version that was remembered before.
///
/// # Errors
/// As [`mujoco`].
pub fn remember(version: &str) -> Result<PathBuf, DownloadError> {
    let folder = mujoco(version)?;
    let cache = cache_folder().ok_or(DownloadError::NoCache)?;
    remember_in(&cache, version, &own_platform())?;
    Ok(folder)
}

/// Forgets the version that [`remember`] has remembered, and returns whether there was one. Its
/// files stay in the cache.
///
/// # Errors
/// [`DownloadError::NoCache`] and [`DownloadError::Write`].
pub fn forget() -> Result<bool, DownloadError> {
    let path = remembering_file(&cache_folder().ok_or(DownloadError::NoCache)?, &own_platform());
    forget_in(&path).map_err(|source| DownloadError::Write { path, source })
}

/// Writes the file anew even if it says the same, because builds look at its time.
fn remember_in(cache: &Path, version: &str, platform: &str) -> Result<(), DownloadError> {
    let name = name_in_cache(REMEMBERED, platform);
    Unpacking::begin(cache)?.replace(&name, format!("{version}\n").as_bytes())
}

fn forget_in(path: &Path) -> io::Result<bool> {
    match fs::remove_file(path) {
        Ok(()) => Ok(true),
        Err(error) if error.kind() == ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{forget_in, remember_in};
    use crate::{
        contents::LIST,
        folders::name_in_cache,
        remembered::{UnusableChoice, remembered, remembering_file},
    };

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    const PLATFORM: &str = "x86_64-linux";

    /// A cache with complete copies of some versions, without their contents.
    fn cache_with(versions: &[&str], platform: &str) -> Result<tempfile::TempDir> {
        let cache = tempfile::tempdir()?;
        for version in versions {
            let folder = cache.path().join(name_in_cache(version, platform));
            fs::create_dir_all(folder.join("include/mujoco"))?;
            let library = format!("libmujoco.so.{version}");
            fs::write(folder.join("include/mujoco/mujoco.h"), "")?;
            fs::write(folder.join(&library), "")?;
            let list = format!("0  include/mujoco/mujoco.h\n0  {library}\n");
            fs::write(folder.join(LIST), list)?;
        }
        Ok(cache)
    }

    #[test]
    fn the_last_version_that_was_asked_for_is_remembered_until_it_is_forgotten() -> Result {
        let cache = cache_with(&["3.6.0", "4.0.1"], PLATFORM)?;
        let cache = cache.path();
        assert_eq!(remembered(cache, PLATFORM), Ok(None));
        for version in ["3.6.0", "4.0.1", "4.0.1"] {
            remember_in(cache, version, PLATFORM)?;
            let found = remembered(cache, PLATFORM)?.ok_or("nothing is remembered")?;
            assert_eq!(found.version, version);
            assert_eq!(found.folder, cache.join(format!("mujoco-{version}")));
        }
        let path = remembering_file(cache, PLATFORM);
        assert_eq!([forget_in(&path)?, forget_in(&path)?], [true, false]);
        assert_eq!(remembered(cache, PLATFORM), Ok(None));
        let mut names: Vec<_> =
            fs::read_dir(cache)?.map(|entry| Ok(entry?.file_name())).collect::<Result<_>>()?;
        names.sort();
        assert_eq!(names, ["mujoco-3.6.0", "mujoco-4.0.1"], "nothing is left over");
        Ok(())
    }

    #[test]
    fn each_platform_has_its_own() -> Result {
        let cache = cache_with(&["3.6.0"], "aarch64-linux")?;
        remember_in(cache.path(), "3.6.0", "aarch64-linux")?;
        let found = remembered(cache.path(), "aarch64-linux")?.ok_or("nothing is remembered")?;
        assert!(found.folder.ends_with("mujoco-3.6.0-aarch64-linux"), "{found:?}");
        for other in [PLATFORM, "x86_64-windows"] {
            assert_eq!(remembered(cache.path(), other), Ok(None));
        }
        Ok(())
    }

    #[test]
    fn a_damaged_file_is_an_error_that_asking_again_repairs() -> Result {
        let cache = cache_with(&["3.6.0"], PLATFORM)?;
        let path = remembering_file(cache.path(), PLATFORM);
        for damaged in ["", "3.6.0", "3.6\n", "3.6.0\n\n", "../3.6.0\n", "\u{0}3.6.0\n"] {
            fs::write(&path, damaged)?;
            let error = remembered(cache.path(), PLATFORM).expect_err("damaged");
            assert_eq!(error, UnusableChoice::Damaged { path: path.clone() }, "{damaged:?}");
            assert!(error.to_string().contains("`fetch-env mujoco`"), "{error}");
        }
        fs::write(&path, b"\xff\n")?;
        assert!(remembered(cache.path(), PLATFORM).is_err(), "it is not UTF-8");
        remember_in(cache.path(), "3.6.0", PLATFORM)?;
        assert!(remembered(cache.path(), PLATFORM)?.is_some());
        Ok(())
    }

    #[test]
    fn a_version_whose_files_are_gone_is_an_error() -> Result {
        for gone in ["", "include/mujoco/mujoco.h", "libmujoco.so.3.6.0", LIST] {
            let cache = cache_with(&["3.6.0"], PLATFORM)?;
            remember_in(cache.path(), "3.6.0", PLATFORM)?;
            let folder = cache.path().join("mujoco-3.6.0");
            match gone {
                "" => fs::remove_dir_all(&folder)?,
                file => fs::remove_file(folder.join(file))?,
            }
            let error = remembered(cache.path(), PLATFORM).expect_err("incomplete");
            assert_eq!(error, UnusableChoice::Incomplete { version: "3.6.0".into(), folder });
            assert!(error.to_string().contains("`fetch-env mujoco system`"), "{error}");
        }
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    fn a_link_in_the_place_of_the_file_is_replaced_and_not_followed() -> Result {
        use std::os::unix::fs::symlink;

        let cache = cache_with(&["3.6.0"], PLATFORM)?;
        let path = remembering_file(cache.path(), PLATFORM);
        let target = cache.path().join("the user's");
        // Also one that says the same already.
        for text in ["a thesis", "3.6.0\n"] {
            fs::write(&target, text)?;
            symlink(&target, &path)?;
            remember_in(cache.path(), "3.6.0", PLATFORM)?;
            assert!(fs::symlink_metadata(&path)?.is_file());
            assert_eq!(fs::read_to_string(&target)?, text);
            fs::remove_file(&path)?;
            symlink(&target, &path)?;
            assert!(forget_in(&path)?);
            assert_eq!(fs::read_to_string(&target)?, text);
        }
        symlink("/dev/zero", &path)?;
        assert!(remembered(cache.path(), PLATFORM).is_err(), "it has no end");
        Ok(())
    }
}
