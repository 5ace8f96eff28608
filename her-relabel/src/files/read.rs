//! Reading files that are regular and of a bounded size.

use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

/// Opens a file for reading. It does not wait for the other end of a pipe, and the file that it
/// returns ends: it is a regular one, also where a symbolic link leads to it.
///
/// # Errors
/// Those of the file system, and [`ErrorKind::InvalidInput`] if the path leads to a directory, a
/// pipe, a device or the like.
pub fn open(path: impl AsRef<Path>) -> io::Result<File> {
    let path = path.as_ref();
    let mut options = OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::custom_flags(&mut options, libc::O_NONBLOCK);
    let file = options.read(true).open(path)?;
    // What was opened is checked, and not the path, which can lead elsewhere by now.
    if !file.metadata()?.is_file() {
        let message = format!("{} is not a regular file: pass a file's path", path.display());
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    Ok(file)
}

/// Returns the contents of a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`open`], and [`ErrorKind::FileTooLarge`] if the file is larger.
pub fn read(path: impl AsRef<Path>, limit: u64) -> io::Result<Vec<u8>> {
    let path = path.as_ref();
    let file = open(path)?;
    let mut bytes = Vec::new();
    let mut len = file.metadata()?.len();
    if len <= limit {
        bytes.try_reserve_exact(len as usize)?;
        // The size of a file that is being written, or of one of the system's, can be more.
        file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
        len = bytes.len() as u64;
    }
    if len > limit {
        let message = format!("{} has more than {limit} bytes", path.display());
        return Err(io::Error::new(ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Returns the text of a regular file of at most `limit` bytes.
///
/// # Errors
/// As [`read`], and [`ErrorKind::InvalidData`] if the file is not UTF-8.
pub fn read_text(path: impl AsRef<Path>, limit: u64) -> io::Result<String> {
    let path = path.as_ref();
    String::from_utf8(read(path, limit)?).map_err(|error| {
        let message = format!("{} is not text in UTF-8: {error}", path.display());
        io::Error::new(ErrorKind::InvalidData, message)
    })
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn a_file_is_read_up_to_its_limit() -> io::Result<()> {
        let directory = tempfile::tempdir()?;
        let path = directory.path().join("file");
        fs::write(&path, "four")?;
        for limit in [4, 5, u64::MAX] {
            assert_eq!(read_text(&path, limit)?, "four");
        }
        for limit in [0, 3] {
            let error = read(&path, limit).expect_err("larger");
            assert_eq!(error.kind(), ErrorKind::FileTooLarge, "{error}");
        }
        fs::write(&path, [0xff])?;
        let error = read_text(&path, 10).expect_err("no text");
        assert!(error.kind() == ErrorKind::InvalidData && error.to_string().contains("file"));
        let missing = read(directory.path().join("missing"), 10).expect_err("no file");
        assert_eq!(missing.kind(), ErrorKind::NotFound);
        // A file with a hole claims its size at once, and takes no room on the disk.
        File::create(&path)?.set_len(1 << 40)?;
        let error = read(&path, 1 << 30).expect_err("larger");
        assert_eq!(error.kind(), ErrorKind::FileTooLarge, "{error}");
        Ok(())
    }

    #[cfg(unix)]
    #[test]
    #[cfg_attr(miri, ignore = "Miri has no such calls of the file system")]
    fn neither_pipes_nor_devices_nor_links_to_them_are_opened() -> io::Result<()> {
        use std::os::unix::fs::symlink;
        use std::process::Command;

        let directory = tempfile::tempdir()?;
        let [pipe, zero, to_pipe, file, link] =
            ["pipe", "zero", "to_pipe", "file", "link"].map(|name| directory.path().join(name));
        assert!(Command::new("mkfifo").arg(&pipe).status()?.success());
        symlink("/dev/zero", &zero)?;
        symlink("pipe", &to_pipe)?;
        for path in [&pipe, &zero, &to_pipe, Path::new("/dev/null"), directory.path()] {
            let error = open(path).expect_err("no regular file");
            assert_eq!(error.kind(), ErrorKind::InvalidInput, "{error}");
            assert!(error.to_string().starts_with(&path.display().to_string()), "{error}");
        }
        fs::write(&file, "text")?;
        symlink("file", &link)?;
        assert_eq!(read_text(&link, 4)?, "text");
        Ok(())
    }
}
