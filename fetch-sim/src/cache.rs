//! The folders in the user's cache, as this program may use them.

mod folders;

use std::path::PathBuf;

use crate::privileges::are_raised;

/// Returns the folder of the reference's model; `None` if the user has no home, or is not trusted.
pub(crate) fn reference_folder() -> Option<PathBuf> {
    if are_raised() { None } else { folders::reference_folder() }
}

/// Returns the folder `fetch-env` in the user's cache; `None` if the user has no home, or is not
/// trusted.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    if are_raised() { None } else { folders::cache_folder() }
}
