//! MuJoCo's library: loading it, and the results of calls into it.

use std::{
    ffi::{CStr, CString, OsStr, c_char, c_int},
    path::{Path, PathBuf},
    ptr::{self, NonNull},
    sync::OnceLock,
};

use fetch_install::version_in_name;

use super::{
    ffi::{self, Item, Opaque, RawFilter, RawModel, RawShapes},
    library_file::LibraryFile,
    search::{Place, Search},
    system::{library_name, resolve},
    unforked::unforked,
    version::MujocoVersion,
};
use crate::error::{SimError, TriedLibrary};

impl MujocoVersion {
    /// Loads the library and returns its version, which equals that of the headers.
    ///
    /// # Errors
    /// [`SimError::BuiltWithoutMujoco`], [`SimError::Library`], [`SimError::MujocoDir`] or
    /// [`SimError::ShimMismatch`].
    pub fn of_library() -> Result<Self, SimError> {
        load_once().map(|_| Self::of_shim())
    }
}

/// Loads MuJoCo, unless it is loaded, and returns the path of its library.
///
/// # Errors
/// As [`MujocoVersion::of_library`].
pub fn library_path() -> Result<PathBuf, SimError> {
    load_once().cloned()
}

/// The library that the program brings.
static CHOSEN: OnceLock<PathBuf> = OnceLock::new();

/// The outcome of loading MuJoCo.
static LOADED: OnceLock<Result<PathBuf, SimError>> = OnceLock::new();

/// Takes MuJoCo from this file, which the program brings: for plugins and extension modules, which
/// have no library beside the executable. Call it before anything else uses MuJoCo; it does not
/// load anything yet.
///
/// The library may have any file name and SONAME, so that it does not clash with another copy in
/// the process; decoders in the folder `plugin` beside it must then be linked to that name. It must
/// have the version of the headers. Who may write to it is not checked, and `MUJOCO_DIR` is
/// ignored.
///
/// ```no_run
/// # #[cfg(not(fetch_sim_no_shim))] {
/// fetch_sim::use_library("/opt/product/lib/libmujoco.so.3.6.0")?;
/// assert!(fetch_sim::library_path()?.starts_with("/opt/product"));
/// # }
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
///
/// # Errors
/// [`SimError::LibraryInUse`] if another library was chosen before, or is loaded; the error of an
/// earlier search, which is not repeated.
pub fn use_library(path: impl AsRef<Path>) -> Result<(), SimError> {
    let path = path.as_ref();
    match LOADED.get() {
        Some(Ok(loaded)) if resolve(path).ok().as_ref() != Some(loaded) => {
            return Err(SimError::LibraryInUse { path: loaded.clone() });
        }
        Some(Err(error)) => return Err(error.clone()),
        _ => {}
    }
    let chosen = unforked(|| CHOSEN.get_or_init(|| path.to_path_buf()));
    if chosen == path { Ok(()) } else { Err(SimError::LibraryInUse { path: chosen.clone() }) }
}

/// Whether the program brings MuJoCo itself: whether it has called [`use_library`].
#[must_use]
pub fn brings_library() -> bool {
    CHOSEN.get().is_some()
}

/// Checks a library or plugin before it is loaded.
pub(super) fn look_at(file: &Path) -> Result<LibraryFile, String> {
    if brings_library() { LibraryFile::chosen(file) } else { LibraryFile::look_at(file) }
}

/// Loads MuJoCo on the first call, and returns the path of its library; later calls return the same
/// result.
pub(crate) fn load_once() -> Result<&'static PathBuf, SimError> {
    let load = || {
        if ffi::IS_MISSING {
            return Err(SimError::BuiltWithoutMujoco);
        }
        compare(&items_of_shim(), ffi::ITEMS)?;
        let version = MujocoVersion::of_shim();
        let global = rust_path(ffi::fs_global_library_path());
        let others = path_of_others(&library_name(version));
        load(&Search {
            chosen: CHOSEN.get().cloned(),
            ..Search::of_process(version, global, others)
        })
    };
    let loaded = LOADED.get().unwrap_or_else(|| unforked(|| LOADED.get_or_init(load)));
    loaded.as_ref().map_err(SimError::clone)
}

/// Loads the first library of a search that fits the headers, and returns its path. Only one call
/// in a process may succeed.
fn load(search: &Search) -> Result<PathBuf, SimError> {
    let mut tried = Vec::new();
    for place in search.places() {
        if place.files.is_empty() {
            tried.push(TriedLibrary { place: place.name, path: None, reason: place.if_empty });
        }
        let Place { name, files, is_loaded, .. } = place;
        for file in files {
            let attempt = if is_loaded { open(&file) } else { load_file(&file, search.version) };
            match attempt {
                Ok(()) => return Ok(path_of_loaded(&file)),
                Err(reason) => tried.push(TriedLibrary { place: name, path: Some(file), reason }),
            }
        }
    }
    let version = search.version.to_string();
    Err(match &search.mujoco_dir {
        Some(value) if search.global.is_none() && search.chosen.is_none() => {
            SimError::MujocoDir { value: value.clone(), version, tried }
        }
        _ => SimError::Library { version, tried },
    })
}

/// Loads a library, or returns why it is refused. Most reasons are found before any of its code
/// runs.
fn load_file(file: &Path, version: MujocoVersion) -> Result<(), String> {
    let library = look_at(file)?;
    let file_name = library.path.file_name().and_then(OsStr::to_str);
    for name in [library.own_name.as_deref(), file_name].into_iter().flatten() {
        let numbers = version_in_name(name).unwrap_or_default();
        if !version.numbers().starts_with(&numbers) {
            let numbers: Vec<_> = numbers.iter().map(u32::to_string).collect();
            return Err(format!("it is MuJoCo {}", numbers.join(".")));
        }
    }
    open(&library.path)
}

/// Opens a library by its path, or returns why it does not fit.
fn open(file: &Path) -> Result<(), String> {
    let path = c_path(file)?;
    let mut version: c_int = 0;
    // SAFETY: `path` is a C string, and `version` is valid for writes. `OnceLock` makes one search,
    // before any other function that needs the library, and nothing is loaded after a success.
    let status = unsafe { ffi::fs_load(path.as_ptr(), &raw mut version) };
    if status != ffi::FS_OK && version != 0 && version != ffi::fs_header_version() {
        return Err(format!("it is MuJoCo {}", MujocoVersion(version)));
    }
    check_as(status, |reason| reason)
}

/// Returns the path of the library that was loaded from `file`.
fn path_of_loaded(file: &Path) -> PathBuf {
    // SAFETY: the library is loaded.
    let path = rust_path(unsafe { ffi::fs_library_path() }).unwrap_or_else(|| file.to_path_buf());
    resolve(&path).unwrap_or(path)
}

/// Returns the path of the library of this name that other code loaded for itself.
fn path_of_others(name: &str) -> Option<PathBuf> {
    let name = c_path(name.as_ref()).ok()?;
    // SAFETY: the name is a C string.
    rust_path(unsafe { ffi::fs_others_library_path(name.as_ptr()) })
}

fn rust_path(path: *const c_char) -> Option<PathBuf> {
    // SAFETY: the loader's name of a library is a C string, and lives until the shim's next call.
    let path = (!path.is_null()).then(|| unsafe { CStr::from_ptr(path) })?;
    // SAFETY: any bytes are valid on Unix; on Windows, where the shim returns UTF-8, that is.
    Some(unsafe { OsStr::from_encoded_bytes_unchecked(path.to_bytes()) }.into())
}

/// Returns a path as C functions take it, in the system's encoding.
pub(crate) fn c_path(path: &Path) -> Result<CString, String> {
    CString::new(path.as_os_str().as_encoded_bytes()).map_err(|error| error.to_string())
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

/// What MuJoCo says, in all versions, when it gets no memory.
const NO_MEMORY: &str = "Could not allocate memory";

/// Turns the status of a shim call into a result, and passes warnings on to `tracing`.
pub(crate) fn check(status: c_int) -> Result<(), SimError> {
    check_as(status, |message| {
        if message.contains(NO_MEMORY) {
            return SimError::NoMemory { what: "a simulation".into() };
        }
        SimError::Mujoco { message }
    })
}

/// Like [`check`], with the error that `error` makes from MuJoCo's message.
pub(crate) fn check_as<E>(status: c_int, error: impl FnOnce(String) -> E) -> Result<(), E> {
    // Both texts are copied first: the host's subscriber may call MuJoCo itself.
    let warning = (status & ffi::FS_WARNED != 0).then(|| {
        // SAFETY: the shim's buffer holds a terminated string, and only this thread writes to it.
        let text = unsafe { CStr::from_ptr(ffi::fs_warning_text()) };
        text.to_string_lossy().into_owned()
    });
    let failure = (status & ffi::FS_FAILED != 0).then(|| {
        // SAFETY: as above.
        let text = unsafe { CStr::from_ptr(ffi::fs_error_text()) };
        text.to_string_lossy().into_owned()
    });
    if let Some(warning) = warning {
        tracing::warn!(target: "mujoco", "{warning}");
    }
    failure.map_or(Ok(()), |message| Err(error(message)))
}

/// An object that the shim made. It is deleted together with this value.
#[derive(Debug)]
pub(crate) struct Owned<T: Opaque>(NonNull<T>);

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
    /// [`SimError::NoMemory`] if it is null.
    ///
    /// # Safety
    /// Nothing else deletes the object, and all that it uses outlives this value.
    pub(crate) unsafe fn new(raw: *mut T, what: &str) -> Result<Self, SimError> {
        NonNull::new(raw).map(Self).ok_or_else(|| SimError::NoMemory { what: what.into() })
    }

    pub(crate) const fn as_ptr(&self) -> *mut T {
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
mod tests;
