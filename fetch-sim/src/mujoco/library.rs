use std::{
    ffi::{CStr, CString, c_char, c_int},
    fmt,
    os::unix::ffi::OsStrExt,
    path::{Path, PathBuf},
    ptr,
    sync::OnceLock,
};

use super::ffi;
use crate::SimError;

/// Where the build found the library.
const LIBRARY_PATH: &str = env!("FETCH_SIM_LIBMUJOCO");

/// A version of MuJoCo, such as 2.2.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MujocoVersion(c_int);

impl MujocoVersion {
    /// The version of the headers that this crate was built against.
    #[must_use]
    pub fn of_headers() -> Self {
        Self(ffi::fs_header_version())
    }

    /// The version of the library that runs: the same as that of the headers.
    ///
    /// # Errors
    /// [`SimError::Library`] or [`SimError::VersionMismatch`].
    pub fn of_library() -> Result<Self, SimError> {
        library().map(|Library| Self::of_headers())
    }
}

impl fmt::Display for MujocoVersion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // 2.2.2 counts as 222, 3.6.0 as 3006000.
        let (major, minor, patch) = if self.0 < 1_000_000 {
            (self.0 / 100, self.0 / 10 % 10, self.0 % 10)
        } else {
            (self.0 / 1_000_000, self.0 / 1000 % 1000, self.0 % 1000)
        };
        write!(f, "{major}.{minor}.{patch}")
    }
}

/// Proof that the shim's functions may be called.
#[derive(Clone, Copy, Debug)]
pub(super) struct Library;

/// Loads MuJoCo on the first call; later calls return the same result.
pub(super) fn library() -> Result<Library, SimError> {
    static LOADED: OnceLock<Result<Library, SimError>> = OnceLock::new();
    LOADED.get_or_init(load).clone()
}

fn load() -> Result<Library, SimError> {
    let failure = |reason: String| SimError::Library { path: LIBRARY_PATH.into(), reason };
    let path = CString::new(LIBRARY_PATH).map_err(|error| failure(error.to_string()))?;
    let plugins = plugin_folder()
        .map(|folder| CString::new(folder.as_os_str().as_bytes()))
        .transpose()
        .map_err(|error| failure(error.to_string()))?;
    let mut reason: [c_char; 512] = [0; 512];
    let mut version: c_int = 0;
    // SAFETY: `path` is a C string, `plugins` is one or null, `version` and `reason` are valid for writes of the sizes told,
    // and `OnceLock` calls this once, before any other function of the shim that needs the library.
    let status = unsafe {
        ffi::fs_load(
            path.as_ptr(),
            plugins.as_ref().map_or(ptr::null(), |folder| folder.as_ptr()),
            &raw mut version,
            reason.as_mut_ptr(),
            reason.len(),
        )
    };
    if status == 0 {
        return Ok(Library);
    }
    if version != 0 && version != ffi::fs_header_version() {
        return Err(SimError::VersionMismatch {
            headers: MujocoVersion::of_headers().to_string(),
            library: MujocoVersion(version).to_string(),
        });
    }
    // SAFETY: the shim wrote a terminated string into `reason`.
    let reason = unsafe { CStr::from_ptr(reason.as_ptr()) };
    Err(failure(reason.to_string_lossy().into_owned()))
}

/// Where wheels and release archives keep plugins, seen from the library.
fn plugin_folder() -> Option<PathBuf> {
    let folder = Path::new(LIBRARY_PATH).parent()?;
    ["plugin", "../bin/mujoco_plugin"]
        .iter()
        .map(|name| folder.join(name))
        .find(|path| path.is_dir())
}

/// Turns the status of a shim call into a result, and passes warnings on to `tracing`.
pub(super) fn check(status: c_int) -> Result<(), SimError> {
    if status & ffi::WARNED != 0 {
        // SAFETY: the shim's buffer holds a terminated string; only this thread writes to it.
        let text = unsafe { CStr::from_ptr(ffi::fs_warning_text()) };
        tracing::warn!(target: "mujoco", "{}", text.to_string_lossy());
    }
    if status & ffi::FAILED != 0 {
        // SAFETY: as above.
        let text = unsafe { CStr::from_ptr(ffi::fs_error_text()) };
        return Err(SimError::Mujoco { message: text.to_string_lossy().into_owned() });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::MujocoVersion;

    #[test]
    fn versions_are_spelled_as_mujoco_does() {
        assert_eq!(MujocoVersion(222).to_string(), "2.2.2");
        assert_eq!(MujocoVersion(330).to_string(), "3.3.0");
        assert_eq!(MujocoVersion(3_006_000).to_string(), "3.6.0");
    }
}
