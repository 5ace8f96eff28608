//! Writing files so that they appear whole or not at all.

use std::fs::File;
use std::io;
use std::path::Path;

use tempfile::NamedTempFile;

/// Writes a temporary file in the same directory and then renames it. If anything fails, a previous file is
/// unchanged.
pub(crate) fn replace<E: From<io::Error>>(
    path: &Path,
    write: impl FnOnce(&mut File) -> Result<(), E>,
) -> Result<(), E> {
    let directory = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut file = create_in(directory)?;
    write(file.as_file_mut())?;
    file.as_file().sync_all()?;
    file.persist(path).map_err(io::Error::from)?;
    // On Unix, the new name is durable once the directory is; elsewhere directories cannot be opened.
    if cfg!(unix) { Ok(File::open(directory)?.sync_all()?) } else { Ok(()) }
}

/// Makes a temporary file with the permissions of an ordinary new file, because temporary files are private by
/// default.
fn create_in(directory: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    #[cfg(unix)]
    let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    #[cfg(unix)]
    let builder = builder.permissions(permissions);
    builder.tempfile_in(directory)
}

#[cfg(test)]
mod tests {
    use std::fs;
    use std::io::Write;
    use std::panic::catch_unwind;

    use super::*;

    #[test]
    fn a_failure_halfway_leaves_the_previous_file_and_nothing_else() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("file");
        replace(&path, |file| file.write_all(b"whole")).expect("a file");
        let full = |file: &mut File| {
            file.write_all(b"ha")?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let error = replace(&path, full).expect_err("no room");
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        let panicked =
            catch_unwind(|| replace(&path, |_| -> io::Result<()> { panic!("a writer may panic") }));
        assert!(panicked.is_err());
        assert_eq!(fs::read(&path).expect("the file"), b"whole");
        assert_eq!(fs::read_dir(directory.path()).expect("the directory").count(), 1);
    }
}
