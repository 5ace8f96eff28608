//! Replacing files so that a later process can prove whose the unfinished ones are.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io;
use std::path::Path;

use super::replace::{kind_of_entry, replace_entry};

/// Replaces an entry of a directory like [`replace_entry`], through files with a mark in their
/// names: `.NAME.MARK`, and on the way there `..NAME.MARK.xxxxxx`. A process that is killed leaves at
/// most one of them, which [`remove_unfinished`] removes.
///
/// Take a random number of 64 bits as the mark, and store it in a file of the same directory: a file
/// that has it in its name is not the user's.
///
/// # Errors
/// As [`replace_entry`].
pub fn replace_marked<E: From<io::Error>>(
    path: impl AsRef<Path>,
    mark: &str,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let path = path.as_ref();
    let is_file = kind_of_entry(path)?.is_some_and(|kind| kind.is_file());
    let mut name = OsString::from(".");
    name.push(path.file_name().unwrap_or_default());
    name.push(format!(".{mark}"));
    let unfinished = path.with_file_name(name);
    replace_entry(&unfinished, |file| {
        if is_file {
            file.set_permissions(fs::metadata(path)?.permissions())?;
        }
        write(file)
    })?;
    fs::rename(&unfinished, path).inspect_err(|_| {
        let _ = fs::remove_file(&unfinished);
    })?;
    Ok(())
}

/// Removes the unfinished files with a mark that killed processes have left in a directory. Call it
/// when no other process writes there with this mark.
///
/// # Errors
/// Those of the file system.
pub fn remove_unfinished(directory: impl AsRef<Path>, mark: &str) -> io::Result<()> {
    let mark = format!(".{mark}");
    for entry in fs::read_dir(directory)? {
        let (entry, path) = entry.map(|entry| (entry.file_type(), entry.path()))?;
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with('.') && name.contains(&mark) && entry?.is_file() {
            fs::remove_file(path)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    const MARK: &str = "0123456789abcdef";

    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn what_has_the_mark_is_removed_and_nothing_else() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let at = |name: &str| directory.path().join(name);
        replace_marked(at("curve.csv"), MARK, |file| file.write_all(b"whole"))?;
        let kept =
            [".curve.csv.backup", ".curve.csv.fedcba9876543210", "curve.csv.0123456789abcdef"];
        let left = [".curve.csv.0123456789abcdef", "..curve.csv.0123456789abcdef.AbCdEf"];
        for name in kept.iter().chain(&left) {
            fs::write(at(name), "text")?;
        }
        fs::create_dir(at(".folder.0123456789abcdef"))?;
        remove_unfinished(directory.path(), MARK)?;
        assert!(kept.iter().all(|name| at(name).exists()));
        assert!(left.iter().all(|name| !at(name).exists()));
        assert!(at(".folder.0123456789abcdef").exists() && fs::read(at("curve.csv"))? == b"whole");
        Ok(())
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn a_failure_leaves_the_previous_file_and_nothing_else() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let path = directory.path().join("file");
        replace_marked(&path, MARK, |file| file.write_all(b"whole"))?;
        let full = |_: &mut File| Err(io::Error::from(io::ErrorKind::StorageFull));
        let error = replace_marked(&path, MARK, full).expect_err("no room");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path)?, b"whole");
        let error =
            replace_marked(directory.path(), MARK, |file| file.write_all(b"a")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        // In the place of the file there is a directory by the time at which it is whole.
        fs::remove_file(&path)?;
        let late = |_: &mut File| fs::create_dir(&path);
        assert!(replace_marked(&path, MARK, late).is_err());
        assert_eq!(fs::read_dir(directory.path())?.count(), 1);
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn permissions_stay_and_links_are_replaced() -> io::Result<()> {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let directory = tempfile::tempdir()?;
        let [path, victim] = ["file", "victim"].map(|name| directory.path().join(name));
        fs::write(&victim, "the user's")?;
        symlink(&victim, &path)?;
        for expected in [0o600, 0o440] {
            replace_marked(&path, MARK, |file| file.write_all(b"new"))?;
            assert!(fs::symlink_metadata(&path)?.is_file());
            fs::set_permissions(&path, fs::Permissions::from_mode(expected))?;
            replace_marked(&path, MARK, |file| file.write_all(b"newer"))?;
            assert_eq!(fs::metadata(&path)?.permissions().mode() & 0o777, expected);
        }
        assert_eq!(fs::read(&victim)?, b"the user's");
        Ok(())
    }
}
