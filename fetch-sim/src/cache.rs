//! The folders in the user's cache that this program may use.

use std::path::PathBuf;

use fetch_install::own_platform;
pub use fetch_install::{Remembered, UnusableChoice};

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

/// Returns the MuJoCo that was asked for once, which builds and programs of this platform take
/// unless `MUJOCO_DIR` names another; `None` if there is none, as for [`reference_folder`], and for
/// programs that bring MuJoCo themselves (feature `bundled`).
///
/// # Errors
/// [`UnusableChoice`], if it cannot be used: it is passed over then.
pub fn remembered_mujoco() -> Result<Option<Remembered>, UnusableChoice> {
    let cache = if cfg!(feature = "bundled") { None } else { cache_folder() };
    cache.map_or(Ok(None), |cache| fetch_install::remembered(&cache, &own_platform()))
}
