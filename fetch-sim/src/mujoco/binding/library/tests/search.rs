//! Tests of the search for the library, each of which needs a separate process.

use std::{
    env,
    error::Error,
    ffi::{CString, c_char, c_int, c_void},
    fs::{self, Permissions},
    io::{self, Write},
    os::unix::fs::PermissionsExt,
    path::{Path, PathBuf},
    process::Command,
};

use fetch_install::own_platform;

use super::super::{MujocoVersion, Search, ffi, library_name, library_path, load, path_of_others};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

/// The parts of a search, as variables of the process that makes it.
const VARIABLES: [&str; 5] = [
    "FETCH_SIM_TEST_DIR",
    "FETCH_SIM_TEST_EXE",
    "FETCH_SIM_TEST_BUILD",
    "FETCH_SIM_TEST_CACHE",
    "FETCH_SIM_TEST_SYSTEM",
];

/// A library that the process opens before it searches.
const BEFORE: &str = "FETCH_SIM_TEST_BEFORE";

unsafe extern "C" {
    fn dlopen(path: *const c_char, flags: c_int) -> *mut c_void;
}

/// Searches as the variables say, if this is a process of the tests below, and prints the outcome.
#[test]
fn search_in_this_process() -> Result {
    let [mujoco_dir, executable, of_build, cache, system] =
        VARIABLES.map(|name| env::var_os(name).map(PathBuf::from));
    let Some(system) = system else { return Ok(()) };
    let version = MujocoVersion::of_shim();
    if let Some(library) = env::var_os(BEFORE) {
        let library = CString::new(library.into_encoded_bytes())?;
        // SAFETY: the path is a C string, and the library is MuJoCo; 2 is RTLD_NOW.
        assert!(!unsafe { dlopen(library.as_ptr(), 2) }.is_null());
    }
    let search = Search {
        version,
        global: None,
        chosen: None,
        mujoco_dir,
        executable,
        remembered: cache
            .as_deref()
            .map_or(Ok(None), |cache| fetch_install::remembered(cache, &own_platform())),
        of_build,
        cache,
        of_others: path_of_others(&library_name(version)),
        system: vec![system],
    };
    let mut lines = vec![match load(&search) {
        Ok(path) => format!("\nloaded {}", path.display()),
        Err(error) => format!("\nrefused {error}"),
    }];
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

/// Returns the name of MuJoCo's folder in the cache.
fn name_in_cache() -> String {
    name_of(&MujocoVersion::of_shim().to_string())
}

/// Returns the name of the folder of a version in the cache.
fn name_of(version: &str) -> String {
    fetch_install::name_in_cache(version, &own_platform())
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

    /// Puts a library of another version into a place, or one that lacks functions. It makes the
    /// file `ran` when it is loaded. Its own name is `own_name`, unless that is empty.
    fn put_unfit(&self, folder: &str, version: i64, own_name: &str) -> Result<PathBuf> {
        let (source, ran) = (self.path("unfit.c"), self.path("ran"));
        let code = format!(
            "#include <stdio.h>\n\
             int mj_version(void) {{ return {version}; }}\n\
             __attribute__((constructor)) static void run(void) {{ fopen(\"{}\", \"w\"); }}",
            ran.display()
        );
        fs::write(&source, code)?;
        let path = self.path(folder).join("libmujoco.so");
        fs::create_dir_all(self.path(folder))?;
        let mut compiler = Command::new("cc");
        if !own_name.is_empty() {
            compiler.arg(format!("-Wl,-soname,{own_name}"));
        }
        let status = compiler.args(["-shared", "-fPIC", "-o"]).arg(&path).arg(&source).status()?;
        assert!(status.success());
        Ok(path)
    }

    /// Remembers a version that the cache has, with a library of this name.
    fn remember(&self, version: &str, library: &str) -> Result {
        let (cache, folder) = (self.path("cache"), self.path("cache").join(name_of(version)));
        fs::create_dir_all(folder.join("include/mujoco"))?;
        fs::write(folder.join("include/mujoco/mujoco.h"), "")?;
        fs::write(
            folder.join("SHA256SUMS"),
            format!("0  include/mujoco/mujoco.h\n0  {library}\n"),
        )?;
        let file = fetch_install::remembering_file(&cache, &own_platform());
        Ok(fs::write(file, format!("{version}\n"))?)
    }

    /// Searches in a separate process, and returns its output.
    fn search(&self, mujoco_dir: Option<&Path>) -> Result<String> {
        self.search_after(None, mujoco_dir)
    }

    /// Like [`search`](Self::search), in a process that has opened a library.
    fn search_after(&self, before: Option<&Path>, mujoco_dir: Option<&Path>) -> Result<String> {
        let name =
            format!("{}::search_in_this_process", module_path!().split_once("::").ok_or("")?.1);
        let build = format!("build/libmujoco.so.{}", MujocoVersion::of_shim());
        let values =
            ["program/bin/it", &build, "cache", "system"].map(|name| Some(self.path(name)));
        let [executable, of_build, cache, system] = values;
        let values = [mujoco_dir.map(Path::to_path_buf), executable, of_build, cache, system];
        let values = VARIABLES.into_iter().zip(values);
        let output = Command::new(env::current_exe()?)
            .args(["--exact", &name, "--nocapture"])
            .envs(values.filter_map(|(name, value)| Some((name, value?))))
            .envs(before.map(|library| (BEFORE, library)))
            .current_dir(self.folder.path())
            .output()?;
        let text = String::from_utf8(output.stdout)?;
        assert!(output.status.success(), "{text}{}", String::from_utf8_lossy(&output.stderr));
        Ok(text)
    }

    /// Returns the library that is loaded without `MUJOCO_DIR`.
    fn found(&self) -> Result<PathBuf> {
        let text = self.search(None)?;
        let line = text.lines().find_map(|line| line.strip_prefix("loaded "));
        Ok(Path::new(line.ok_or(text.clone())?).to_path_buf())
    }

    /// Returns the reasons of a search that finds nothing.
    fn refusal(&self, mujoco_dir: Option<&Path>) -> Result<String> {
        let text = self.search(mujoco_dir)?;
        assert!(!text.contains("\nmapped "), "{text}");
        let line = text.lines().find_map(|line| line.strip_prefix("refused "));
        Ok(line.ok_or(text.clone())?.to_owned())
    }

    /// Lets others write to a file or folder.
    fn allow_others(&self, path: &Path) -> Result {
        Ok(fs::set_permissions(path, Permissions::from_mode(0o777))?)
    }
}

#[test]
fn each_place_is_searched_in_turn() -> Result {
    let places = Places::new()?;
    let cache = format!("cache/{}", name_in_cache());
    for folder in ["system", &cache, "build", "program/lib", "program/bin"] {
        let put = places.put(folder)?;
        assert_eq!(places.found()?, put, "{folder}");
    }
    for folder in ["dir/lib", "dir"] {
        let put = places.put(folder)?;
        let text = places.search(Some(&places.path("dir")))?;
        assert!(text.contains(&format!("\nloaded {}\n", put.display())), "{text}");
    }
    Ok(())
}

#[test]
fn the_remembered_library_comes_before_that_of_the_build() -> Result {
    let (places, version) = (Places::new()?, MujocoVersion::of_shim().to_string());
    let cached = places.put(&format!("cache/{}", name_in_cache()))?;
    let of_build = places.put("build")?;
    assert_eq!(places.found()?, of_build);
    places.remember(&version, &format!("libmujoco.so.{version}"))?;
    assert_eq!(places.found()?, cached);
    let beside = places.put("program/bin")?;
    assert_eq!(places.found()?, beside);
    fs::remove_file(beside)?;
    fs::remove_file(cached)?;
    assert_eq!(places.found()?, of_build, "what was remembered is gone");
    fs::remove_file(of_build)?;
    let refused = places.refusal(None)?;
    let reason = format!("the remembered MuJoCo: MuJoCo {version} is remembered, but ");
    assert!(refused.contains(&reason), "{refused}");
    Ok(())
}

#[test]
fn a_program_of_another_version_than_the_remembered_keeps_its_own() -> Result {
    let places = Places::new()?;
    let unfit = format!("cache/{}", name_of("9.8.7"));
    places.put_unfit(&unfit, 9_008_007, "libmujoco.so.9.8.7")?;
    fs::rename(
        places.path(&unfit).join("libmujoco.so"),
        places.path(&unfit).join("libmujoco.so.9.8.7"),
    )?;
    places.remember("9.8.7", "libmujoco.so.9.8.7")?;
    let of_build = places.put("build")?;
    assert_eq!(places.found()?, of_build);
    fs::remove_file(of_build)?;
    let refused = places.refusal(None)?;
    let reason = "the remembered MuJoCo: it is MuJoCo 9.8.7: build this program again";
    assert!(refused.contains(reason), "{refused}");
    assert!(!places.path("ran").exists());
    Ok(())
}

#[test]
fn a_library_that_others_in_the_process_have_comes_before_the_systems() -> Result {
    let places = Places::new()?;
    places.put("system")?;
    let theirs = places.put("theirs")?;
    let text = places.search_after(Some(&theirs), None)?;
    assert!(text.contains(&format!("\nloaded {}\n", theirs.display())), "{text}");
    assert_eq!(text.matches("\nmapped ").count(), 1, "{text}");
    Ok(())
}

#[test]
fn libraries_that_do_not_fit_are_passed_over_and_do_not_stay() -> Result {
    let places = Places::new()?;
    let version = ffi::fs_header_version();
    let other = places.put_unfit("program/bin", 9_008_007, "")?;
    let lacking = places.put_unfit("program/lib", version.into(), "")?;
    let cache = format!("cache/{}", name_in_cache());
    let put = places.put(&cache)?;
    let text = places.search(None)?;
    assert!(text.contains(&format!("loaded {}", put.display())), "{text}");
    let mapped: Vec<_> = text.lines().filter(|line| line.starts_with("mapped ")).collect();
    assert_eq!(mapped, [format!("mapped {}", put.display())]);

    fs::remove_file(put)?;
    fs::write(places.path("system").join("libmujoco.so"), "a text, and no library")?;
    let refused = places.refusal(None)?;
    for reason in [
        format!("{}: it is MuJoCo 9.8.7", other.display()),
        format!("{}: it has no function ", lacking.display()),
        "beside the executable: ".into(),
        "the path of the build: ".into(),
        "does not exist".into(),
        "the cache: ".into(),
        "this process: no other code has loaded one".into(),
        format!(
            "the system: {}/libmujoco.so: it is not a library",
            places.path("system").display()
        ),
        format!("cargo xtask mujoco {}", MujocoVersion::of_shim()),
        "fetch_sim::download::mujoco(".into(),
    ] {
        assert!(refused.contains(&reason), "{reason}\n{refused}");
    }
    Ok(())
}

/// Loading a library would run its code.
#[test]
fn the_code_of_another_version_does_not_run() -> Result {
    let places = Places::new()?;
    let named = places.put_unfit("program/bin", 9_008_007, "")?;
    fs::rename(named, places.path("program/bin/libmujoco.so.9.8.7"))?;
    places.put_unfit("program/lib", 9_008_007, "libmujoco.so.9.8.7")?;
    let refused = places.refusal(None)?;
    assert_eq!(refused.matches(": it is MuJoCo 9.8.7").count(), 2, "{refused}");
    assert!(!places.path("ran").exists());
    Ok(())
}

#[test]
fn the_code_that_others_may_have_written_does_not_run() -> Result {
    let places = Places::new()?;
    let version = ffi::fs_header_version();
    let library = places.put_unfit("program/bin", version.into(), "")?;
    for path in [library.as_path(), &places.path("program/bin"), &places.path("program")] {
        places.allow_others(path)?;
        let refused = places.refusal(None)?;
        let reason = format!("others may write to {}", path.canonicalize()?.display());
        // Where others may write to the folder above, `lib` is not even looked for.
        assert!(refused.contains(&reason), "{reason}\n{refused}");
        assert!(!places.path("ran").exists());
        fs::set_permissions(path, Permissions::from_mode(0o755))?;
    }
    places.refusal(None)?;
    assert!(places.path("ran").exists(), "it would have run");
    Ok(())
}

/// As in `/tmp`, into which anyone may put a folder `lib`.
#[test]
fn no_lib_is_looked_for_in_a_folder_that_others_may_write_to() -> Result {
    let places = Places::new()?;
    let put = places.put("program/lib")?;
    assert_eq!(places.found()?, put);
    fs::set_permissions(places.path("program"), Permissions::from_mode(0o1777))?;
    let refused = places.refusal(None)?;
    assert!(!refused.contains("program/lib"), "{refused}");
    Ok(())
}

/// The loader would map what is not there, and the process would end at the first access.
#[test]
fn a_library_that_is_cut_is_refused() -> Result {
    let places = Places::new()?;
    let library = fs::read(&places.library)?;
    let path = places.path("program/bin/libmujoco.so");
    for length in [0, 3, 63, 64, 1000, 200_000, library.len() / 2, library.len() - 1] {
        fs::write(&path, &library[..length])?;
        let refused = places.refusal(None)?;
        let reason = format!("libmujoco.so: it is truncated or damaged ({length} bytes)");
        assert!(refused.contains(&reason), "{refused}");
    }
    Ok(())
}

/// Using another library instead would hide the mistake.
#[test]
fn a_wrong_mujoco_dir_is_an_error_whatever_else_there_is() -> Result {
    let places = Places::new()?;
    let put = places.put("program/bin")?;
    let other = places.put_unfit("dir/lib", 9_008_007, "libmujoco.so.9.8.7")?;
    let version = MujocoVersion::of_shim();
    for (value, reason) in [
        (Path::new("/nonexistent"), "/nonexistent does not exist".to_owned()),
        (Path::new("libmujoco.so"), "libmujoco.so does not exist".into()),
        (&places.path("cache"), "cache has no libmujoco.so".into()),
        (&places.path("dir"), "it is MuJoCo 9.8.7".into()),
        (&other, format!("{}: it is MuJoCo 9.8.7", other.display())),
    ] {
        let refused = places.refusal(Some(value))?;
        let named = format!("MUJOCO_DIR is {}, ", value.display());
        for part in [&named, &reason, "unset it", &format!("cargo xtask mujoco {version}")] {
            assert!(refused.contains(part), "{part}\n{refused}");
        }
    }
    assert_eq!(places.found()?, put);
    // A bare name is a file of the current folder, and not one of the system's.
    fs::copy(&places.library, places.path("libmujoco.so"))?;
    let text = places.search(Some(Path::new("libmujoco.so")))?;
    let expected = places.path("libmujoco.so").canonicalize()?;
    assert!(text.contains(&format!("\nloaded {}\n", expected.display())), "{text}");
    Ok(())
}
