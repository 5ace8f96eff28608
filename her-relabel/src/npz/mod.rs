//! Exchanging episodes with numpy, on top of adding and saving.

pub(crate) mod array;
pub(crate) mod export;
mod header;
pub(crate) mod import;
pub(crate) mod ogbench;

use std::io;
use std::path::Path;

use crate::files::read;

/// The largest file that is read into memory.
const MOST_BYTES: u64 = 1 << 36;

/// Returns the contents of an archive.
fn contents(path: &Path) -> io::Result<Vec<u8>> {
    read(path, MOST_BYTES)
}

/// Converts an archive's error to an I/O error.
fn io_error(error: rawzip::Error) -> io::Error {
    match error.into_kind() {
        rawzip::ErrorKind::IO(error) => error,
        kind => io::Error::new(io::ErrorKind::InvalidData, rawzip::Error::from(kind)),
    }
}
