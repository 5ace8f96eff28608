//! The folders into which xtask downloads models and MuJoCo.
//!
//! xtask includes this file by its path, because it must build where fetch-sim cannot: this needs
//! nothing but the standard library.

use std::{env, path::PathBuf};

/// Returns the folder of the reference's model; `None` if the user has no home.
pub(crate) fn reference_folder() -> Option<PathBuf> {
    non_empty("FETCH_ASSETS_DIR").or_else(|| Some(cache_folder()?.join("gymnasium-robotics-1.4.2")))
}

/// Returns the folder `fetch-env` in the user's cache; `None` if the user has no home.
pub(crate) fn cache_folder() -> Option<PathBuf> {
    let cache = non_empty("XDG_CACHE_HOME")
        .filter(|path| path.is_absolute())
        .or_else(|| Some(env::home_dir()?.join(".cache")))?;
    Some(cache.join("fetch-env"))
}

fn non_empty(variable: &str) -> Option<PathBuf> {
    env::var_os(variable).filter(|value| !value.is_empty()).map(PathBuf::from)
}
