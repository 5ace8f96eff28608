//! The differences between systems: the names of MuJoCo's libraries, the folders in which the
//! system has libraries, and the checks of a file before it is loaded.

#[cfg(target_vendor = "apple")]
mod apple;
#[cfg(all(unix, not(target_vendor = "apple")))]
mod elf;
#[cfg(unix)]
mod owners;
#[cfg(windows)]
mod windows;

#[cfg(target_vendor = "apple")]
pub(super) use self::apple::{DECODER_FILES, LIBRARY, folders, library_name, own_name};
#[cfg(all(unix, not(target_vendor = "apple")))]
pub(super) use self::elf::{DECODER_FILES, LIBRARY, folders, library_name, own_name};
#[cfg(unix)]
pub(super) use self::owners::{check_owners, is_shared};
#[cfg(windows)]
pub(super) use self::windows::{
    DECODER_FILES, LIBRARY, check_owners, folders, is_shared, library_name, own_name, resolve,
};
/// Returns the path of a file without links.
#[cfg(unix)]
pub(super) use std::fs::canonicalize as resolve;
