//! MuJoCo's library: loading it, its version, and the results of calls into it.

use std::{
    ffi::{CStr, CString, c_int},
    fmt,
    os::unix::ffi::OsStringExt,
    path::{Path, PathBuf},
    ptr::{self, NonNull},
    sync::OnceLock,
};

use super::ffi::{self, Item, Opaque, RawFilter, RawModel, RawShapes};
use crate::error::SimError;

/// Path of the library that the build found.
const LIBRARY_PATH: &str = env!("FETCH_SIM_LIBMUJOCO");

/// A version of MuJoCo, such as 2.2.2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct MujocoVersion(c_int);

impl MujocoVersion {
    /// Returns the version of the headers against which this crate was built.
    #[must_use]
    pub fn of_headers() -> Self {
        Self(ffi::fs_header_version())
    }

    /// Loads the library and returns its version, which equals that of the headers.
    ///
    /// # Errors
    /// [`SimError::Library`], [`SimError::VersionMismatch`] or [`SimError::ShimMismatch`].
    pub fn of_library() -> Result<Self, SimError> {
        load_once().map(|()| Self::of_headers())
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

/// Loads MuJoCo on the first call; later calls return the same result.
pub(super) fn load_once() -> Result<(), SimError> {
    static LOADED: OnceLock<Result<(), SimError>> = OnceLock::new();
    LOADED.get_or_init(load).clone()
}

fn load() -> Result<(), SimError> {
    compare(&items_of_shim(), ffi::ITEMS)?;
    let failure = |reason: String| SimError::Library { path: LIBRARY_PATH.into(), reason };
    let path = CString::new(LIBRARY_PATH).map_err(|error| failure(error.to_string()))?;
    let plugins = plugin_folder().map(|folder| CString::new(folder.into_os_string().into_vec()));
    let plugins = plugins.transpose().map_err(|error| failure(error.to_string()))?;
    let plugins = plugins.as_ref().map_or(ptr::null(), |folder| folder.as_ptr());
    let mut version: c_int = 0;
    // SAFETY: `path` is a C string, `plugins` is one or null, and `version` is valid for writes.
    // `OnceLock` makes this call once, before any other function that needs the library.
    let status = unsafe { ffi::fs_load(path.as_ptr(), plugins, &raw mut version) };
    if status != ffi::FS_OK && version != 0 && version != ffi::fs_header_version() {
        return Err(SimError::VersionMismatch {
            headers: MujocoVersion::of_headers().to_string(),
            library: MujocoVersion(version).to_string(),
        });
    }
    check_as(status, failure)
}

/// Returns the folder in which wheels and release archives keep plugins.
fn plugin_folder() -> Option<PathBuf> {
    let folder = Path::new(LIBRARY_PATH).parent()?;
    ["plugin", "../bin/mujoco_plugin"]
        .iter()
        .map(|name| folder.join(name))
        .find(|path| path.is_dir())
}

/// Returns the contract as the shim was compiled with it.
fn items_of_shim() -> Vec<Item> {
    let item = |index| {
        let (mut name, mut value, mut size) = (ptr::null(), 0, 0);
        // SAFETY: the three results are valid for writes.
        let is_there =
            unsafe { ffi::fs_contract(index, &raw mut name, &raw mut value, &raw mut size) } != 0;
        is_there.then(|| {
            // SAFETY: the name of an item is a string literal of the shim.
            let name: &'static CStr = unsafe { CStr::from_ptr(name) };
            (name.to_str().unwrap_or("(not UTF-8)"), value, size)
        })
    };
    (0..).map_while(item).collect()
}

/// Compares the contract of the shim with that of Rust: an item that is different, or is missing on
/// one side, is an error.
fn compare(shim: &[Item], rust: &[Item]) -> Result<(), SimError> {
    let find = |side: &[Item], name| side.iter().find(|item| item.0 == name).copied();
    let tell = |item: Option<Item>| {
        item.map_or("missing".into(), |(_, value, size)| format!("{value} ({size} bytes)"))
    };
    for &(name, ..) in shim.iter().chain(rust) {
        let (in_c, in_rust) = (find(shim, name), find(rust, name));
        if in_c != in_rust {
            let (item, shim, rust) = (name.into(), tell(in_c), tell(in_rust));
            return Err(SimError::ShimMismatch { item, shim, rust });
        }
    }
    Ok(())
}

/// Turns the status of a shim call into a result, and passes warnings on to `tracing`.
pub(super) fn check(status: c_int) -> Result<(), SimError> {
    check_as(status, |message| SimError::Mujoco { message })
}

/// As [`check`], with the error that `error` makes from MuJoCo's message.
pub(super) fn check_as<E>(status: c_int, error: impl FnOnce(String) -> E) -> Result<(), E> {
    if status & ffi::FS_WARNED != 0 {
        // SAFETY: the shim's buffer holds a terminated string, and only this thread writes to it.
        let text = unsafe { CStr::from_ptr(ffi::fs_warning_text()) };
        tracing::warn!(target: "mujoco", "{}", text.to_string_lossy());
    }
    if status & ffi::FS_FAILED != 0 {
        // SAFETY: as above.
        let text = unsafe { CStr::from_ptr(ffi::fs_error_text()) };
        return Err(error(text.to_string_lossy().into_owned()));
    }
    Ok(())
}

/// An object that the shim made. It is deleted together with this value.
#[derive(Debug)]
pub(super) struct Owned<T: Opaque>(NonNull<T>);

/// Objects that are plain memory and belong to no thread. Methods that take a shared reference to
/// their owner only read them: MuJoCo does not write to a model that is passed as const.
trait PlainMemory: Opaque {}
impl PlainMemory for RawModel {}
impl PlainMemory for RawShapes {}
impl PlainMemory for RawFilter {}

// SAFETY: the object belongs to no thread, and is owned.
unsafe impl<T: PlainMemory> Send for Owned<T> {}
// SAFETY: shared references only read the object.
unsafe impl<T: PlainMemory> Sync for Owned<T> {}

impl<T: Opaque> Owned<T> {
    /// Takes the result of a call that makes an object.
    ///
    /// # Errors
    /// [`SimError::Mujoco`] if it is null: memory ran out.
    ///
    /// # Safety
    /// Nothing else deletes the object, and all that it uses outlives this value.
    pub(super) unsafe fn new(raw: *mut T, what: &str) -> Result<Self, SimError> {
        NonNull::new(raw)
            .map(Self)
            .ok_or_else(|| SimError::Mujoco { message: format!("there is no memory for {what}") })
    }

    pub(super) const fn as_ptr(&self) -> *mut T {
        self.0.as_ptr()
    }
}

impl<T: Opaque> Drop for Owned<T> {
    fn drop(&mut self) {
        // SAFETY: the object is owned, so nothing uses it any more.
        unsafe { T::DELETE(self.0.as_ptr()) };
    }
}

#[cfg(test)]
mod tests {
    use super::{Item, MujocoVersion, compare, ffi::ITEMS, items_of_shim};
    use crate::error::SimError;

    #[test]
    fn versions_are_spelled_as_mujoco_does() {
        assert_eq!(MujocoVersion(222).to_string(), "2.2.2");
        assert_eq!(MujocoVersion(330).to_string(), "3.3.0");
        assert_eq!(MujocoVersion(3_006_000).to_string(), "3.6.0");
    }

    #[test]
    fn the_shim_and_rust_share_one_contract() {
        assert_eq!(compare(&items_of_shim(), ITEMS), Ok(()));
        assert!(ITEMS.len() > 60, "{} items", ITEMS.len());
    }

    #[test]
    fn a_mismatch_is_an_error_that_names_the_item() {
        let mismatch = |shim: &[Item]| match compare(shim, ITEMS) {
            Err(SimError::ShimMismatch { item, .. }) => item,
            other => panic!("{other:?}"),
        };
        for (at, &(name, value, size)) in ITEMS.iter().enumerate() {
            let with = |changed: &[Item]| [&ITEMS[..at], changed, &ITEMS[at + 1..]].concat();
            assert_eq!(mismatch(&with(&[(name, value + 1, size)])), name);
            assert_eq!(mismatch(&with(&[(name, value, size + 4)])), name);
            assert_eq!(mismatch(&with(&[])), name);
        }
        assert_eq!(mismatch(&[ITEMS, &[("fs_sizes.nkey", 0, 4)]].concat()), "fs_sizes.nkey");
    }
}
