//! The plugins through which some versions of MuJoCo (3.6 among them) read mesh files.
//!
//! A process may have more than one user of MuJoCo, and MuJoCo ends it when a plugin registers
//! twice. So only the decoders are loaded, and only once a model could not be compiled without
//! them.

use std::{
    path::{Path, PathBuf},
    sync::OnceLock,
};

use super::{
    ffi,
    library::{c_path, check_as, library_path, look_at},
    system::{DECODER_FILES, library_name},
    unforked::unforked,
    version::MujocoVersion,
};

/// The outcome of loading the decoders.
#[derive(Debug, Default)]
pub(crate) struct Decoders {
    /// Whether some were loaded.
    pub(crate) loaded: bool,
    /// Why others were not loaded.
    pub(crate) failures: Vec<String>,
}

static DECODERS: OnceLock<Decoders> = OnceLock::new();

impl Decoders {
    /// Returns whether the decoders have been loaded, or could not be.
    pub(crate) fn are_settled() -> bool {
        DECODERS.get().is_some()
    }

    /// Loads the decoders of the library that is loaded; later calls return the same result.
    pub(crate) fn load() -> &'static Self {
        let load = || {
            let mut decoders = Self::default();
            for file in files() {
                match load_plugin(&file) {
                    Ok(()) => decoders.loaded = true,
                    Err(reason) => {
                        decoders.failures.push(format!("{}: {reason}", file.display()));
                    }
                }
            }
            decoders
        };
        DECODERS.get().unwrap_or_else(|| unforked(|| DECODERS.get_or_init(load)))
    }
}

/// Returns the decoders beside the library, in the folder in which wheels and release archives keep
/// plugins.
fn files() -> Vec<PathBuf> {
    let library = library_path().ok();
    let folder = library.as_deref().and_then(Path::parent);
    let candidates = folder.into_iter().flat_map(|folder| {
        ["plugin", "../bin/mujoco_plugin"]
            .into_iter()
            .flat_map(move |plugins| DECODER_FILES.map(|name| folder.join(plugins).join(name)))
    });
    candidates.filter(|file| file.is_file()).collect()
}

fn load_plugin(file: &Path) -> Result<(), String> {
    let plugin = look_at(file)?;
    let library = library_path().map_err(|error| error.to_string())?;
    // The name under which the system knows the library, and finds it for a plugin.
    let own_name = look_at(&library)?.own_name;
    let library = own_name.unwrap_or_else(|| library_name(MujocoVersion::of_shim()));
    let (file, library) = (c_path(&plugin.path)?, c_path(library.as_ref())?);
    // SAFETY: the library is loaded, and both are C strings.
    let status = unsafe { ffi::fs_load_plugin(file.as_ptr(), library.as_ptr()) };
    // A warning would be passed on to the host, for which a fork must not wait.
    check_as(status & ffi::FS_FAILED, |reason| reason)
}
