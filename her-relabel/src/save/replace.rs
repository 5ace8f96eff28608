//! Writing files so that they appear whole or not at all.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use atomic_write_file::AtomicWriteFile;

/// The number of symbolic links that lead to a file, at most, as on Linux.
const MAX_LINKS: usize = 40;

/// How old a temporary file is that its process has left over: longer than it takes to rename one.
const LEFT_OVER: Duration = Duration::from_secs(60);

/// Writes a file without a name in the same directory, and then gives it the name of the file that it
/// replaces, with its permissions. If anything fails, a previous file is unchanged, and nothing else is
/// left over. A process that is killed between the last two steps, naming the file and giving it its
/// own name, leaves one over, which a save a minute later removes. A symbolic link stays one: the
/// file that it leads to is replaced.
pub(crate) fn replace<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let path = target_of(path)?;
    // A path without metadata has no file yet, or cannot be opened below.
    if fs::metadata(&path).is_ok_and(|metadata| !metadata.is_file()) {
        let message = format!("{} is not a regular file: choose another path", path.display());
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message).into());
    }
    let mut file = AtomicWriteFile::open(&path)?;
    write(file.as_file_mut())?;
    file.commit()?;
    remove_left_over(&path);
    Ok(())
}

/// Removes old temporary files of a file, as far as that is possible.
fn remove_left_over(path: &Path) {
    let directory = path.parent().filter(|parent| !parent.as_os_str().is_empty());
    let entries = fs::read_dir(directory.unwrap_or(Path::new("."))).into_iter().flatten();
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else { return };
    for entry in entries.flatten() {
        let entry_name = entry.file_name();
        // `.name.` and six characters.
        let suffix = entry_name
            .to_str()
            .and_then(|entry| entry.strip_prefix('.')?.strip_prefix(name)?.strip_prefix('.'));
        let is_temporary = suffix.is_some_and(|suffix| {
            suffix.len() == 6 && suffix.bytes().all(|byte| byte.is_ascii_alphanumeric())
        });
        let age = entry.metadata().and_then(|metadata| metadata.modified());
        let is_old = age.is_ok_and(|time| time.elapsed().is_ok_and(|age| age > LEFT_OVER));
        if is_temporary && is_old {
            // Another process may have removed it.
            let _ = fs::remove_file(entry.path());
        }
    }
}

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
    Err(io::Error::other(format!("{} is a link in a circle", path.display())))
}

#[cfg(test)]
mod tests {
    use std::io::Write;
    use std::panic::catch_unwind;
    use std::time::SystemTime;

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
    fn old_temporary_files_of_the_same_file_are_removed() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let of = |name: &str| directory.path().join(name);
        let old = SystemTime::now() - 2 * LEFT_OVER;
        for name in [".file.a1B2c3", ".file.a1b2c3d", ".other.a1B2c3", "file.a1B2c3"] {
            File::create(of(name))?.set_modified(old)?;
        }
        File::create(of(".file.younge"))?;
        written(&of("file"), "text")?;
        assert!(!of(".file.a1B2c3").exists());
        assert_eq!(fs::read_dir(directory.path())?.count(), 5);
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
    fn what_is_no_regular_file_is_refused_and_stays() -> io::Result<()> {
        use std::os::unix::fs::FileTypeExt;
        use std::process::Command;

        let directory = tempfile::tempdir()?;
        let pipe = directory.path().join("pipe");
        assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
        for path in [&pipe, Path::new("/dev/null"), directory.path()] {
            let error = written(path, "text").expect_err("no regular file");
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{error}");
        }
        assert!(fs::metadata(&pipe)?.file_type().is_fifo());
        assert!(fs::metadata("/dev/null")?.file_type().is_char_device());
        Ok(())
    }
}
