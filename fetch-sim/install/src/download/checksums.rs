//! SHA-256 checksums of files, and lists of them as `sha256sum` writes them.

use std::path::Path;

use hmac_sha256::Hash;

use crate::regular_file;

/// The name of a file and its SHA-256, in hexadecimal.
pub(super) type Listed<'a> = (&'a str, &'a str);

/// Returns the files of a list; `None` if it is damaged.
pub(super) fn parse(list: &str) -> Option<Vec<Listed<'_>>> {
    list.lines().map(|line| line.split_once("  ").map(|(sha256, name)| (name, sha256))).collect()
}

/// Returns whether all files of a list are in a folder, with the listed checksums.
pub(super) fn are_there(folder: &Path, files: &[Listed<'_>]) -> bool {
    files.iter().all(|(name, sha256)| {
        regular_file::read(&folder.join(name))
            .is_ok_and(|bytes| check(name, &bytes, sha256).is_ok())
    })
}

/// Checks that the bytes have this SHA-256, in hexadecimal.
///
/// # Errors
/// The difference.
pub(super) fn check(name: &str, bytes: &[u8], expected: &str) -> Result<(), String> {
    let found = hexadecimal(&Hash::hash(bytes));
    if found == expected {
        return Ok(());
    }
    Err(format!("{name} has the SHA-256 {found}, not {expected}"))
}

pub(super) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}
