//! Tests of the search for the library, which each need a process of their own.

use std::{
    env,
    error::Error,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::Command,
};

use super::super::{MujocoVersion, Search, ffi, library_path, load};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

/// The parts of a search, as variables of the process that makes it.
const VARIABLES: [&str; 4] =
    ["FETCH_SIM_TEST_DIR", "FETCH_SIM_TEST_EXE", "FETCH_SIM_TEST_BUILD", "FETCH_SIM_TEST_CACHE"];

/// Searches as the variables say, if this is a process of the tests below, and prints the outcome.
#[test]
fn search_in_this_process() -> Result {
    let [mujoco_dir, executable, of_build, cache] =
        VARIABLES.map(|name| env::var_os(name).map(PathBuf::from));
    let version = MujocoVersion::of_shim();
    if executable.is_none() {
        return Ok(());
    }
    let mut lines =
        vec![
            match load(&Search { version, mujoco_dir, executable, of_build, cache, global: None }) {
                Ok(path) => format!("\nloaded {}", path.display()),
                Err(error) => format!("\nrefused {error}"),
            },
        ];
    let maps = fs::read_to_string("/proc/self/maps")?;
    let files = maps.lines().filter_map(|line| line.split_once(" /"));
    lines.extend(
        files
            .filter(|(_, path)| path.contains("libmujoco"))
            .map(|(_, path)| format!("mapped /{path}")),
    );
    lines.dedup();
    writeln!(io::stdout(), "{}", lines.join("\n"))?;
    Ok(())
}

/// Folders for every place, all of them empty.
struct Places {
    folder: tempfile::TempDir,
    library: PathBuf,
}

const FOLDERS: [&str; 6] = ["dir/lib", "program/bin", "program/lib", "build", "cache", "system"];

impl Places {
    fn new() -> Result<Self> {
        let folder = tempfile::tempdir()?;
        for name in FOLDERS {
            fs::create_dir_all(folder.path().join(name))?;
        }
        Ok(Self { folder, library: library_path()? })
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Puts the library into a place, under a name that has its version.
    fn put(&self, folder: &str) -> Result<PathBuf> {
        let name = format!("libmujoco.so.{}", MujocoVersion::of_shim());
        let path = self.path(folder).join(name);
        fs::create_dir_all(self.path(folder))?;
        fs::copy(&self.library, &path)?;
        Ok(path.canonicalize()?)
    }

    /// Puts a library of another version into a place, or one that lacks functions.
    fn put_unfit(&self, folder: &str, version: i64) -> Result<PathBuf> {
        let source = self.path("unfit.c");
        fs::write(&source, format!("int mj_version(void) {{ return {version}; }}"))?;
        let path = self.path(folder).join("libmujoco.so");
        fs::create_dir_all(self.path(folder))?;
        let status = Command::new("cc").args(["-shared", "-o"]).arg(&path).arg(&source).status()?;
        assert!(status.success());
        Ok(path)
    }

    /// Searches in a process of its own, and returns what it printed.
    fn search(&self) -> Result<String> {
        let name =
            format!("{}::search_in_this_process", module_path!().split_once("::").ok_or("")?.1);
        let build = format!("build/libmujoco.so.{}", MujocoVersion::of_shim());
        let values = ["dir", "program/bin/it", &build, "cache"].map(|name| self.path(name));
        let output = Command::new(env::current_exe()?)
            .args(["--exact", &name, "--nocapture"])
            .envs(VARIABLES.into_iter().zip(values))
            .env("LD_LIBRARY_PATH", self.path("system"))
            .output()?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Ok(String::from_utf8(output.stdout)?)
    }

    fn found(&self) -> Result<PathBuf> {
        let text = self.search()?;
        let line = text.lines().find_map(|line| line.strip_prefix("loaded "));
        Ok(Path::new(line.ok_or(text.clone())?).to_path_buf())
    }
}

#[test]
fn each_place_is_searched_in_turn() -> Result {
    let places = Places::new()?;
    let cache = format!("cache/mujoco-{}", MujocoVersion::of_shim());
    for folder in ["system", &cache, "build", "program/lib", "program/bin", "dir/lib", "dir"] {
        let put = places.put(folder)?;
        assert_eq!(places.found()?, put, "{folder}");
    }
    Ok(())
}

#[test]
fn libraries_that_do_not_fit_are_passed_over_and_do_not_stay() -> Result {
    let places = Places::new()?;
    let version = ffi::fs_header_version();
    let other = places.put_unfit("dir", 9_008_007)?;
    let lacking = places.put_unfit("program/lib", version.into())?;
    fs::write(places.path("program/bin/libmujoco.so"), "no library")?;
    let put = places.put("build")?;
    let text = places.search()?;
    assert!(text.contains(&format!("loaded {}", put.display())), "{text}");
    let mapped: Vec<_> = text.lines().filter(|line| line.starts_with("mapped ")).collect();
    assert_eq!(mapped, [format!("mapped {}", put.display())]);

    fs::remove_file(put)?;
    let text = places.search()?;
    // Unless the system has it, which is no mistake.
    if let Some(refused) = text.lines().find_map(|line| line.strip_prefix("refused ")) {
        for reason in [
            format!("MUJOCO_DIR: {}: it is MuJoCo 9.8.7", other.display()),
            format!("{}: it has no function ", lacking.display()),
            "beside the executable: ".into(),
            "the path of the build: ".into(),
            "does not exist".into(),
            "the cache: ".into(),
            "the system: libmujoco.so: ".into(),
            format!("cargo xtask mujoco {}", MujocoVersion::of_shim()),
            "fetch_sim::fetch::mujoco(".into(),
        ] {
            assert!(refused.contains(&reason), "{reason}\n{refused}");
        }
        assert!(!text.contains("\nmapped "), "{text}");
    }
    Ok(())
}
