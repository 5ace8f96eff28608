//! SHA-256 checksums of files.

use std::path::Path;

use hmac_sha256::Hash;

use crate::{contents::Listed, regular_file};

/// Returns whether a listed file is in a folder, with its checksum.
pub(super) fn is_there(folder: &Path, (name, sha256): &Listed<'_>) -> bool {
    regular_file::read(&folder.join(name)).is_ok_and(|bytes| check(name, &bytes, sha256).is_ok())
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
