//! Finding MuJoCo's headers and library for a build.

use std::{
    error::Error,
    fmt, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    folders::{NONE, cache_folder, mujoco_dir, own_platform},
    installation::libraries_of,
    remembered::{Remembered, UnusableChoice, remembered},
};

/// Folders of the system's headers.
pub const SYSTEM_PREFIXES: [&str; 2] = ["/usr/local/include", "/usr/include"];

/// The parts of MuJoCo that a build needs.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Found {
    /// Folder of `mujoco/mujoco.h`.
    pub include: PathBuf,
    /// The library, for which programs also look elsewhere.
    pub library: Option<PathBuf>,
    /// The place in which both are.
    pub origin: Origin,
}

/// A place in which a build looks for MuJoCo.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Origin {
    /// `MUJOCO_DIR` names it.
    MujocoDir,
    /// The user has asked for it once.
    Remembered(Remembered),
    /// The system has it.
    System,
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::MujocoDir => f.write_str("the MuJoCo that MUJOCO_DIR names"),
            Self::Remembered(Remembered { version, .. }) => {
                write!(f, "the remembered MuJoCo {version}")
            }
            Self::System => f.write_str("the system's MuJoCo"),
        }
    }
}

/// Error returned when `MUJOCO_DIR` does not name an installation of MuJoCo.
//
// Implemented by hand: this crate builds at once, without thiserror.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NotMujoco {
    /// The value of the variable.
    pub value: PathBuf,
    /// What it lacks.
    pub missing: &'static str,
}

impl fmt::Display for NotMujoco {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MUJOCO_DIR names {}, which has no {}", self.value.display(), self.missing)
    }
}

impl Error for NotMujoco {}

/// The places in which a build looks for MuJoCo, in the order of its fields.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Places {
    /// The value of `MUJOCO_DIR`.
    pub mujoco_dir: Option<PathBuf>,
    /// The folder `fetch-env` in the user's cache, for the MuJoCo that is remembered there.
    pub cache: Option<PathBuf>,
    /// The platform for which one is looked for, such as `aarch64-linux`.
    pub platform: String,
    /// The folders of the system's headers.
    pub system: Vec<PathBuf>,
}

impl Places {
    /// Returns the places of this machine, for programs of this platform.
    #[must_use]
    pub fn of_machine() -> Self {
        Self::for_platform(own_platform())
    }

    /// Returns the places of this machine, for programs of another platform.
    #[must_use]
    pub fn for_platform(platform: String) -> Self {
        let system = SYSTEM_PREFIXES.map(PathBuf::from).to_vec();
        Self { mujoco_dir: mujoco_dir(), cache: cache_folder(), platform, system }
    }

    /// Returns the installation that `MUJOCO_DIR` names, or else the one that is remembered, or else
    /// the system's, whose library folders the C compiler knows; `None` if there is none.
    ///
    /// What is remembered but cannot be used is passed over: [`remembered`](Self::remembered)
    /// says why.
    ///
    /// # Errors
    /// [`NotMujoco`] if `MUJOCO_DIR` names something else: a build without MuJoCo would hide the
    /// mistake.
    pub fn find(&self, compiler: impl FnOnce() -> Command) -> Result<Option<Found>, NotMujoco> {
        match &self.mujoco_dir {
            Some(dir) if dir.as_os_str() == NONE => return Ok(None),
            Some(dir) => return find_in(dir, Origin::MujocoDir).map(Some),
            None => {}
        }
        let remembered = self.remembered().ok().flatten().and_then(|remembered| {
            find_in(&remembered.folder.clone(), Origin::Remembered(remembered)).ok()
        });
        Ok(remembered.or_else(|| self.find_in_system(compiler)))
    }

    /// Returns the MuJoCo that is remembered, if there is one.
    ///
    /// # Errors
    /// [`UnusableChoice`].
    pub fn remembered(&self) -> Result<Option<Remembered>, UnusableChoice> {
        self.cache.as_ref().map_or(Ok(None), |cache| remembered(cache, &self.platform))
    }

    fn find_in_system(&self, compiler: impl FnOnce() -> Command) -> Option<Found> {
        let include = self.system.iter().find(|folder| has_header(folder))?.clone();
        // The compiler answers with a bare name if it finds no such file.
        let output = compiler()
            .arg("-print-file-name=libmujoco.so")
            .output()
            .or_else(|_| Command::new("cc").arg("-print-file-name=libmujoco.so").output());
        let answer =
            output.ok().map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
        let library = answer.and_then(|answer| fs::canonicalize(answer).ok());
        Some(Found { include, library, origin: Origin::System })
    }
}

fn find_in(dir: &Path, origin: Origin) -> Result<Found, NotMujoco> {
    let lacks = |missing| NotMujoco { value: dir.into(), missing };
    // The folders around a file are those of its installation.
    let (skipped, taken) = if dir.is_file() { (1, 2) } else { (0, 1) };
    let folders = dir.ancestors().skip(skipped).take(taken);
    let include = folders
        .map(|folder| folder.join("include"))
        .find(|include| has_header(include))
        .ok_or_else(|| lacks("include/mujoco/mujoco.h"))?;
    let library = libraries_of(dir)
        .into_iter()
        .find_map(|library| fs::canonicalize(library).ok())
        .ok_or_else(|| lacks("libmujoco.so"))?;
    Ok(Found { include, library: Some(library), origin })
}

fn has_header(include: &Path) -> bool {
    include.join("mujoco/mujoco.h").is_file()
}

#[cfg(test)]
mod tests {
    use std::{fs, path::Path, process::Command};

    use super::{Origin, Places};
    use crate::remembered::remembering_file;

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    const PLATFORM: &str = "x86_64-linux";

    /// Puts an installation of MuJoCo 3.6.0 into a folder, without contents.
    fn put_mujoco(folder: &Path) -> Result {
        fs::create_dir_all(folder.join("include/mujoco"))?;
        fs::write(folder.join("include/mujoco/mujoco.h"), "")?;
        fs::write(folder.join("libmujoco.so.3.6.0"), "")?;
        let list = "0  include/mujoco/mujoco.h\n0  libmujoco.so.3.6.0\n";
        Ok(fs::write(folder.join("SHA256SUMS"), list)?)
    }

    /// A compiler that knows no library.
    fn compiler() -> Command {
        Command::new("true")
    }

    #[test]
    fn mujoco_dir_comes_first_then_the_remembered_and_then_the_system() -> Result {
        let folder = tempfile::tempdir()?;
        let root = fs::canonicalize(folder.path())?;
        let [named, cache, system] = ["named", "cache", "system"].map(|name| root.join(name));
        put_mujoco(&named)?;
        put_mujoco(&cache.join("mujoco-3.6.0"))?;
        put_mujoco(&system)?;
        fs::write(remembering_file(&cache, PLATFORM), "3.6.0\n")?;
        let mut places = Places {
            mujoco_dir: Some(named.clone()),
            cache: Some(cache.clone()),
            platform: PLATFORM.into(),
            system: vec![root.join("nothing"), system.join("include")],
        };
        let found = places.find(compiler)?.ok_or("nothing")?;
        assert_eq!(found.origin, Origin::MujocoDir);
        assert_eq!(found.library, Some(named.join("libmujoco.so.3.6.0")));

        places.mujoco_dir = None;
        let found = places.find(compiler)?.ok_or("nothing")?;
        assert_eq!(found.include, cache.join("mujoco-3.6.0/include"));
        assert_eq!(found.library, Some(cache.join("mujoco-3.6.0/libmujoco.so.3.6.0")));
        assert_eq!(found.origin.to_string(), "the remembered MuJoCo 3.6.0");

        let passed_over = Places { platform: "aarch64-linux".into(), ..places.clone() };
        let no_cache = Places { cache: None, ..places.clone() };
        for places in [passed_over, no_cache] {
            let found = places.find(compiler)?.ok_or("nothing")?;
            assert_eq!((found.origin, found.include), (Origin::System, system.join("include")));
        }
        fs::remove_file(cache.join("mujoco-3.6.0/include/mujoco/mujoco.h"))?;
        assert_eq!(places.find(compiler)?.ok_or("nothing")?.origin, Origin::System);
        assert!(places.remembered().is_err(), "and it is said why");
        places.system.clear();
        assert_eq!(places.find(compiler)?, None);
        Ok(())
    }

    #[test]
    fn a_mujoco_dir_goes_before_what_is_remembered_even_if_it_is_wrong_or_none() -> Result {
        let cache = tempfile::tempdir()?;
        put_mujoco(&cache.path().join("mujoco-3.6.0"))?;
        fs::write(remembering_file(cache.path(), PLATFORM), "3.6.0\n")?;
        let find = |mujoco_dir: &str| {
            let places = Places {
                mujoco_dir: Some(mujoco_dir.into()),
                cache: Some(cache.path().into()),
                platform: PLATFORM.into(),
                system: Vec::new(),
            };
            places.find(compiler)
        };
        assert_eq!(find("none"), Ok(None));
        let wrong = find("/nonexistent").expect_err("it names nothing");
        assert!(wrong.to_string().contains("MUJOCO_DIR names /nonexistent"), "{wrong}");
        Ok(())
    }
}
