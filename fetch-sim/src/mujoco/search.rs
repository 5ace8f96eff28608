//! The places in which a program looks for MuJoCo's library.

use std::{
    env,
    ffi::OsStr,
    path::{Path, PathBuf},
};

use super::library::MujocoVersion;
use crate::{
    cache,
    installation::{NONE, libraries_in, libraries_of, mujoco_dir},
};

/// A search for the library of one version.
pub(super) struct Search {
    pub(super) version: MujocoVersion,
    /// Value of `MUJOCO_DIR`.
    pub(super) mujoco_dir: Option<PathBuf>,
    pub(super) executable: Option<PathBuf>,
    /// Path of the library that the build found.
    pub(super) of_build: Option<PathBuf>,
    /// The folder `fetch-env` in the user's cache.
    pub(super) cache: Option<PathBuf>,
    /// Path of the library that somebody else loaded for the whole process.
    pub(super) global: Option<PathBuf>,
}

/// A place in which libraries may be.
pub(super) struct Place {
    pub(super) name: &'static str,
    /// The libraries in it.
    pub(super) files: Vec<PathBuf>,
    /// The reason to give if there are none.
    pub(super) if_empty: String,
}

impl Search {
    /// Returns the search of this process.
    pub(super) fn of_process(version: MujocoVersion, global: Option<PathBuf>) -> Self {
        let executable = env::current_exe().ok();
        Self {
            version,
            mujoco_dir: mujoco_dir().filter(|dir| dir.as_os_str() != NONE),
            executable: executable.map(|path| path.canonicalize().unwrap_or(path)),
            of_build: option_env!("FETCH_SIM_LIBMUJOCO").map(PathBuf::from),
            cache: cache::cache_folder(),
            global,
        }
    }

    /// Returns the places, in the order in which they are tried. A library that the user provides for
    /// this process or this program comes before the one of the build, which comes before those that
    /// merely have the same version.
    pub(super) fn places(&self) -> [Place; 6] {
        let Self { version, mujoco_dir, executable, of_build, cache, global } = self;
        let none_in = |folder: &Path| format!("{} has no libmujoco.so", folder.display());
        let place = |name, folder: Option<&Path>, files: fn(&Path) -> Vec<PathBuf>, unset: &str| {
            let files = folder.map(files).unwrap_or_default();
            let if_empty = folder.map_or_else(|| unset.to_owned(), none_in);
            Place { name, files: self.fitting_first(files), if_empty }
        };
        let beside = executable.as_deref().and_then(Path::parent);
        let cached = cache.as_ref().map(|cache| cache.join(format!("mujoco-{version}")));
        let existing =
            |path: &Path| path.is_file().then(|| path.to_path_buf()).into_iter().collect();
        let gone = |path: &Path| format!("{} does not exist", path.display());
        [
            place("MUJOCO_DIR", mujoco_dir.as_deref(), libraries_of, "it is not set"),
            place("beside the executable", beside, libraries_beside, "its path is unknown"),
            Place {
                name: "the path of the build",
                files: of_build.as_deref().map(existing).unwrap_or_default(),
                if_empty: of_build.as_deref().map_or_else(|| "it found none".into(), gone),
            },
            place("the cache", cached.as_deref(), libraries_in, "the user has no home"),
            Place { name: "the system", files: self.system_names(), if_empty: String::new() },
            // Where there is one, all others are refused.
            Place {
                name: "this process",
                files: global.iter().cloned().collect(),
                if_empty: "nothing has loaded one for all of it".into(),
            },
        ]
    }

    /// Returns libraries with those first that have the version in their names.
    fn fitting_first(&self, mut files: Vec<PathBuf>) -> Vec<PathBuf> {
        let version = format!(".{}", self.version);
        let has_version = |path: &PathBuf| {
            let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
            name.ends_with(&version) || name.ends_with(&format!("{version}.dylib"))
        };
        files.sort_by_key(|path| !has_version(path));
        files
    }

    /// Returns the names by which the system's loader may know the library.
    fn system_names(&self) -> Vec<PathBuf> {
        let version = self.version;
        let names = if cfg!(target_os = "macos") {
            [format!("libmujoco.{version}.dylib"), "libmujoco.dylib".into()]
        } else {
            [format!("libmujoco.so.{version}"), "libmujoco.so".into()]
        };
        names.map(PathBuf::from).into()
    }
}

/// Returns the libraries in the folder of a program, and in the folder `lib` beside that one.
fn libraries_beside(folder: &Path) -> Vec<PathBuf> {
    let mut libraries = libraries_in(folder);
    libraries
        .extend(folder.parent().into_iter().flat_map(|parent| libraries_in(&parent.join("lib"))));
    libraries
}
