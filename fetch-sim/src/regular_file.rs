//! Files that end: a pipe waits for its other end, and a device may go on for ever.

use std::{
    fs,
    io::{self, ErrorKind},
    path::Path,
};

/// Checks that a path does not lead to a pipe, a device or a folder. Without a file, the call that opens it
/// fails.
pub(crate) fn check(path: &Path) -> io::Result<()> {
    match fs::metadata(path) {
        Ok(metadata) if !metadata.is_file() => {
            Err(io::Error::new(ErrorKind::InvalidInput, "it is not a regular file"))
        }
        _ => Ok(()),
    }
}

/// Reads a regular file.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    check(path).and_then(|()| fs::read(path))
}
