//! Writing files so that they appear whole or not at all.

use std::fs::{self, File, FileType};
use std::io;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;

/// The maximal number of symbolic links that lead to a file, as on Linux.
const MAX_LINKS: usize = 40;

/// Replaces a file that a user named, or creates it. `write` gets a file without a name in the same
/// directory, which then gets the name and the permissions of the file that it replaces. If
/// anything fails, a previous file is unchanged, and nothing else is left over. A symbolic link is
/// kept: the file that it leads to is replaced.
///
/// At the end the file gets the name `.NAME.xxxxxx`, and is then renamed. A process that is killed
/// in between leaves that file, and so does one that is killed while it writes to a file system
/// without unnamed files (`O_TMPFILE`). Nothing proves later whose file it is, so it is left for
/// the user.
///
/// # Errors
/// Those of `write` and of the file system, and [`io::ErrorKind::InvalidInput`] if the path is a
/// directory, a device or the like.
pub fn replace<E: From<io::Error>>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    commit(&target_of(path.as_ref())?, write)
}

/// Replaces an entry of a directory, or creates it, otherwise like [`replace()`]: a symbolic link
/// is replaced, and what it leads to stays as it is. It is for the names that a program chooses in
/// a directory that a user named, where a link can have been planted.
///
/// # Errors
/// As [`replace()`].
pub fn replace_entry<E: From<io::Error>>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    commit(path.as_ref(), write)
}

/// Writes a new file and renames it to `path`, which is no link that is to be followed.
fn commit<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let is_link = kind_of_entry(path)?.is_some_and(|kind| kind.is_symlink());
    let mut file = if is_link { open_as_new(path)? } else { AtomicWriteFile::open(path)? };
    write(file.as_file_mut())?;
    let written = file.as_file().try_clone()?;
    file.commit().inspect_err(|_| remove_other_names(&written, path))?;
    Ok(())
}

/// Returns what is to be replaced: a regular file, a link, or `None` for nothing.
pub(super) fn kind_of_entry(path: &Path) -> io::Result<Option<FileType>> {
    // Without metadata there is no file yet, or opening it fails.
    let kind = fs::symlink_metadata(path).ok().map(|metadata| metadata.file_type());
    if kind.is_some_and(|kind| !kind.is_file() && !kind.is_symlink()) {
        let message = format!("{} is not a regular file: choose another path", path.display());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    Ok(kind)
}

/// Opens the file that replaces a link. It gets the permissions of a new file: a link's own allow
/// everybody to write, and its owner can be another user.
fn open_as_new(path: &Path) -> io::Result<AtomicWriteFile> {
    #[cfg(unix)]
    {
        use atomic_write_file::unix::OpenOptionsExt;

        AtomicWriteFile::options().preserve_mode(false).preserve_owner(false).open(path)
    }
    #[cfg(not(unix))]
    AtomicWriteFile::open(path)
}

/// Removes the names other than `path` that a file has in its directory, if possible: a failed
/// renaming leaves the temporary one. While the file is open, no other file has its number.
#[cfg(unix)]
fn remove_other_names(file: &File, path: &Path) {
    use std::os::unix::fs::MetadataExt;

    let number = |metadata: fs::Metadata| (metadata.dev(), metadata.ino());
    let Ok(own) = file.metadata().map(number) else { return };
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let entries = fs::read_dir(directory.unwrap_or(Path::new("."))).into_iter().flatten();
    for entry in entries.flatten() {
        let is_other = Some(&*entry.file_name()) != path.file_name();
        if is_other && entry.metadata().is_ok_and(|metadata| number(metadata) == own) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(not(unix))]
fn remove_other_names(_file: &File, _path: &Path) {}

/// Returns the path that symbolic links lead to, where there may be no file yet.
fn target_of(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MAX_LINKS {
        match fs::read_link(&path) {
            // A relative target starts where the link is.
            Ok(target) => path = path.parent().unwrap_or(Path::new("")).join(target),
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::other(format!("{} is part of a loop of symbolic links", path.display())))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::panic::catch_unwind;

    use super::*;

    fn written(path: &Path, text: &str) -> io::Result<()> {
        replace(path, |file| file.write_all(text.as_bytes()))
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn a_failure_halfway_leaves_the_previous_file_and_nothing_else() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let path = directory.path().join("file");
        written(&path, "whole")?;
        let full = |file: &mut File| {
            file.write_all(b"ha")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let error = replace(&path, full).expect_err("no room");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        let panicked =
            catch_unwind(|| replace(&path, |_| -> io::Result<()> { panic!("a writer may panic") }));
        assert!(panicked.is_err());
        assert_eq!(fs::read(&path)?, b"whole");
        assert_eq!(fs::read_dir(directory.path())?.count(), 1);
        Ok(())
    }

    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn a_failure_of_the_last_step_leaves_nothing() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let path = directory.path().join("file");
        let error = replace(&path, |_| fs::create_dir(&path)).expect_err("a directory stays");
        assert_eq!(error.kind(), io::ErrorKind::IsADirectory);
        assert_eq!(fs::read_dir(directory.path())?.count(), 1);
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn permissions_and_links_stay() -> io::Result<()> {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let directory = tempfile::tempdir()?;
        let [path, link, far, circle] =
            ["file", "link", "far", "circle"].map(|name| directory.path().join(name));
        written(&path, "first")?;
        let mode =
            |path: &Path| Ok::<_, io::Error>(fs::metadata(path)?.permissions().mode() & 0o777);
        for expected in [0o600, 0o640, 0o444] {
            fs::set_permissions(&path, fs::Permissions::from_mode(expected))?;
            written(&path, "second")?;
            assert_eq!(mode(&path)?, expected);
        }
        symlink("file", &link)?;
        symlink(&link, &far)?;
        written(&far, "through two links")?;
        assert!(
            fs::symlink_metadata(&link)?.is_symlink() && fs::symlink_metadata(&far)?.is_symlink()
        );
        assert_eq!(fs::read_to_string(&path)?, "through two links");
        fs::remove_file(&path)?;
        written(&far, "new")?;
        assert_eq!(fs::read_to_string(&path)?, "new");
        symlink("circle", &circle)?;
        assert!(written(&circle, "nowhere").is_err());
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn an_entry_replaces_a_link_whose_target_and_permissions_are_not_taken() -> io::Result<()> {
        use std::os::unix::fs::{PermissionsExt, symlink};

        let directory = tempfile::tempdir()?;
        let [victim, link, nowhere, fresh] =
            ["victim", "link", "nowhere", "fresh"].map(|name| directory.path().join(name));
        fs::write(&victim, "the user's")?;
        symlink(&victim, &link)?;
        symlink("missing", &nowhere)?;
        for path in [&link, &nowhere, &fresh] {
            replace_entry(path, |file| file.write_all(b"new"))?;
            let metadata = fs::symlink_metadata(path)?;
            assert!(metadata.is_file() && fs::read(path)? == b"new", "{}", path.display());
        }
        let mode = fs::metadata(&link)?.permissions().mode();
        assert_eq!(mode, fs::metadata(&fresh)?.permissions().mode());
        assert_eq!(fs::read(&victim)?, b"the user's");
        assert!(!directory.path().join("missing").exists());
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn what_is_no_regular_file_is_refused_and_stays() -> io::Result<()> {
        use std::os::unix::fs::FileTypeExt;
        use std::process::Command;

        let directory = tempfile::tempdir()?;
        let pipe = directory.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
        for path in [&pipe, Path::new("/dev/null"), directory.path()] {
            let entry = replace_entry(path, |file| file.write_all(b"text"));
            for outcome in [written(path, "text"), entry] {
                let error = outcome.expect_err("no regular file");
                assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
            }
        }
        assert!(fs::metadata(&pipe)?.file_type().is_fifo());
        assert!(fs::metadata("/dev/null")?.file_type().is_char_device());
        Ok(())
    }
}
