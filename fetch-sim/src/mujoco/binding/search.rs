//! The places in which a program looks for MuJoCo's library.

use std::{
    env,
    ffi::OsStr,
    path::{Path, PathBuf},
};

use fetch_install::{
    NONE, Remembered, UnusableChoice, libraries_in, libraries_of, mujoco_dir, name_in_cache,
    own_platform,
};

use super::{
    system::{self, LIBRARY, is_shared, library_name},
    version::MujocoVersion,
};
use crate::{cache, privileges};

/// A search for the library of one version.
pub(crate) struct Search {
    pub(crate) version: MujocoVersion,
    /// The library that other code loaded for the whole process: any other would call its
    /// functions.
    pub(crate) global: Option<PathBuf>,
    /// The library that the program brings.
    pub(crate) chosen: Option<PathBuf>,
    /// Value of `MUJOCO_DIR`.
    pub(crate) mujoco_dir: Option<PathBuf>,
    pub(crate) executable: Option<PathBuf>,
    /// What the user has asked for once.
    pub(crate) remembered: Result<Option<Remembered>, UnusableChoice>,
    /// Path of the library that the build found.
    pub(crate) of_build: Option<PathBuf>,
    /// The folder `fetch-env` in the user's cache.
    pub(crate) cache: Option<PathBuf>,
    /// The library of this version that other code loaded for itself.
    pub(crate) of_others: Option<PathBuf>,
    /// The folders of the system's libraries.
    pub(crate) system: Vec<PathBuf>,
}

/// A place in which libraries may be.
pub(crate) struct Place {
    pub(crate) name: &'static str,
    /// The libraries in it.
    pub(crate) files: Vec<PathBuf>,
    /// Whether they are loaded already.
    pub(crate) is_loaded: bool,
    /// The reason to give if there are none.
    pub(crate) if_empty: String,
}

impl Search {
    /// Returns the search of this process, in which other code may have loaded libraries.
    pub(crate) fn of_process(
        version: MujocoVersion,
        global: Option<PathBuf>,
        of_others: Option<PathBuf>,
    ) -> Self {
        let executable = env::current_exe().ok();
        let wish = mujoco_dir().filter(|dir| dir.as_os_str() != NONE);
        Self {
            version,
            global,
            chosen: None,
            mujoco_dir: wish.filter(|_| !privileges::are_raised()),
            executable: executable.map(|path| path.canonicalize().unwrap_or(path)),
            remembered: cache::remembered_mujoco(),
            of_build: option_env!("FETCH_SIM_LIBMUJOCO").map(PathBuf::from),
            cache: cache::cache_folder(),
            of_others,
            system: system::folders(),
        }
    }

    /// Returns the places, in the order in which they are tried.
    ///
    /// A library that is loaded for the whole process is the only place. So is the library that the
    /// program has chosen, or else `MUJOCO_DIR`, because using another library would hide a
    /// mistake. Otherwise, the libraries beside the program come first, then the one that the user
    /// has asked for, then the library of the build, and then others of the same version.
    pub(crate) fn places(&self) -> Vec<Place> {
        if let Some(global) = &self.global {
            return vec![loaded(Some(global))];
        }
        let place = |name, files: Vec<PathBuf>, if_empty| Place {
            name,
            files: self.fitting_first(files),
            is_loaded: false,
            if_empty,
        };
        if let Some(chosen) = &self.chosen {
            let files = vec![chosen.clone()];
            return vec![place("the program's choice", files, String::new())];
        }
        if let Some(dir) = &self.mujoco_dir {
            let fault = if dir.exists() { &format!("has no {LIBRARY}") } else { "does not exist" };
            let if_empty = format!("{} {fault}", dir.display());
            return vec![place("MUJOCO_DIR", libraries_of(dir), if_empty)];
        }
        let Self { executable, of_build, cache, .. } = self;
        let none_in = |folder: &Path| format!("{} has no {LIBRARY}", folder.display());
        let beside = executable.as_deref().and_then(Path::parent);
        let version = self.version.to_string();
        let cached =
            cache.as_ref().map(|cache| cache.join(name_in_cache(&version, &own_platform())));
        let mut places = vec![place(
            "beside the executable",
            beside.map(libraries_beside).unwrap_or_default(),
            beside.map_or_else(|| "its path is unknown".into(), none_in),
        )];
        let remembered = match &self.remembered {
            Ok(None) => None,
            Ok(Some(it)) if it.version == version => {
                Some((libraries_in(&it.folder), none_in(&it.folder)))
            }
            Ok(Some(it)) => {
                let reason = format!("it is MuJoCo {}: build this program again", it.version);
                Some((Vec::new(), reason))
            }
            Err(unusable) => Some((Vec::new(), unusable.to_string())),
        };
        places.extend(
            remembered.map(|(files, if_empty)| place("the remembered MuJoCo", files, if_empty)),
        );
        places.extend([
            place(
                "the path of the build",
                of_build.iter().filter(|path| path.is_file()).cloned().collect(),
                of_build.as_deref().map_or_else(
                    || "it found none".into(),
                    |path| format!("{} does not exist", path.display()),
                ),
            ),
            place(
                "the cache",
                cached.as_deref().map(libraries_in).unwrap_or_default(),
                cached.as_deref().map_or_else(|| "the user has none".into(), none_in),
            ),
            loaded(self.of_others.as_ref()),
            place("the system", self.libraries_of_system(), none_in_all(&self.system)),
        ]);
        places
    }

    /// Returns the libraries, first those with the version in their names.
    fn fitting_first(&self, mut files: Vec<PathBuf>) -> Vec<PathBuf> {
        let version = format!(".{}", self.version);
        let has_version = |path: &PathBuf| {
            let name = path.file_name().and_then(OsStr::to_str).unwrap_or_default();
            name.ends_with(&version) || name.ends_with(&format!("{version}.dylib"))
        };
        files.sort_by_key(|path| !has_version(path));
        files
    }

    /// Returns the system's libraries by the names that they may have. The system's loader does not
    /// look for them, so that they are checked before their code runs.
    fn libraries_of_system(&self) -> Vec<PathBuf> {
        let names = [library_name(self.version), LIBRARY.to_owned()];
        let paths = self.system.iter().flat_map(|folder| names.each_ref().map(|n| folder.join(n)));
        paths.filter(|path| path.is_file()).collect()
    }
}

/// Returns the place of a library that other code has loaded.
fn loaded(file: Option<&PathBuf>) -> Place {
    Place {
        name: "this process",
        files: file.into_iter().cloned().collect(),
        is_loaded: true,
        if_empty: "no other code has loaded one".into(),
    }
}

/// Returns the libraries in the folder of a program, and in the folder `lib` beside that one,
/// unless others may make a `lib` there: a program in `/tmp/build` looks for nothing in `/tmp/lib`.
fn libraries_beside(folder: &Path) -> Vec<PathBuf> {
    let parent = folder.parent().filter(|parent| !is_shared(parent));
    let lib = parent.map(|parent| libraries_in(&parent.join("lib")));
    [libraries_in(folder), lib.unwrap_or_default()].concat()
}

/// Says that no folder has a library.
fn none_in_all(folders: &[PathBuf]) -> String {
    let list: Vec<_> = folders.iter().map(|folder| folder.display().to_string()).collect();
    match list.join(", ") {
        list if list.is_empty() => "it has no folders for them".into(),
        list => format!("{list} have no {LIBRARY}"),
    }
}
