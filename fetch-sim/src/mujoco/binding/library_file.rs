//! The file of a library, checked before it is loaded, because loading runs its code.

use std::path::{Path, PathBuf};

use super::system::{check_owners, own_name, resolve};

/// A library that may be loaded.
pub(crate) struct LibraryFile {
    /// Its path, without links.
    pub(crate) path: PathBuf,
    /// The name that it gives itself, such as `libmujoco.so.2.2.2`, where files have one.
    pub(crate) own_name: Option<String>,
}

impl LibraryFile {
    /// Checks a library without loading it.
    ///
    /// # Errors
    /// The reason not to load it: it is missing or truncated, or users other than this one and root
    /// may have written it.
    pub(crate) fn look_at(file: &Path) -> Result<Self, String> {
        let library = Self::chosen(file)?;
        check_owners(&library.path)?;
        Ok(library)
    }

    /// Checks a library as [`look_at`](Self::look_at) does, but not which users may have written
    /// it, because the program brings it.
    ///
    /// # Errors
    /// The reason not to load it: it is missing or truncated.
    pub(crate) fn chosen(file: &Path) -> Result<Self, String> {
        let path = resolve(file).map_err(|error| error.to_string())?;
        let own_name = own_name(&path)?;
        Ok(Self { path, own_name })
    }
}
