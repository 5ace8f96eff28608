//! Files that end: a pipe waits for its other end, and a device may go on for ever.

use std::{
    fs,
    io::{self, ErrorKind},
    path::Path,
};

/// Checks that a path does not lead to a pipe, a device or a folder. It does not look whether there
/// is a file at all: the call that opens it fails then.
///
/// # Errors
/// If the path leads to something else.
pub fn check(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => {
            Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"))
        }
        _ => Ok(()),
    }
}

/// Reads a regular file.
///
/// # Errors
/// As [`check`], and those of reading.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    check(path).and_then(|()| fs::read(path))
}
