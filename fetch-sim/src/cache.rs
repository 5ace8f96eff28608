//! The folders in the user's cache that this program may use.

use std::path::PathBuf;

use crate::privileges::are_raised;

/// Returns the folder of the reference model, which need not exist: `FETCH_ASSETS_DIR` if that is
/// set, and otherwise a folder in [`cache_folder`]. `None` if the user has no home, or if the
/// program has more privileges than the user.
#[must_use]
pub fn reference_folder() -> Option<PathBuf> {
    if are_raised() { None } else { fetch_install::reference_folder() }
}

/// Returns the folder `fetch-env` in the user's cache (`XDG_CACHE_HOME`, or `.cache` at home), into
/// which models and versions of MuJoCo are downloaded. `None` as for [`reference_folder`].
#[must_use]
pub fn cache_folder() -> Option<PathBuf> {
    if are_raised() { None } else { fetch_install::cache_folder() }
}
