//! A program finds MuJoCo's library wherever it is moved.
#![cfg(all(feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{
    env,
    error::Error,
    fs,
    io::{self, Write},
    path::{Path, PathBuf},
    process::Command,
};

use fetch_sim::{MujocoSimulator, SimConfig, Task, library_path};

type Result<T = (), E = Box<dyn Error>> = std::result::Result<T, E>;

/// Makes a simulator, if this is a copy of the program, and prints the library's path.
#[test]
fn simulate_in_this_process() -> Result {
    if env::var_os("FETCH_SIM_TEST_MOVED").is_some() {
        MujocoSimulator::new(&SimConfig::new(Task::Reach))?;
        writeln!(io::stdout(), "\nloaded {}", library_path()?.display())?;
    }
    Ok(())
}

/// Returns the path of the library that a copy of this program loads.
fn loaded_by(program: &Path, mujoco_dir: &Path) -> Result<PathBuf> {
    let output = Command::new(program)
        .args(["--exact", "simulate_in_this_process", "--nocapture"])
        .env("FETCH_SIM_TEST_MOVED", "1")
        .env("MUJOCO_DIR", mujoco_dir)
        .output()?;
    let text = String::from_utf8(output.stdout)?;
    let path = text.lines().find_map(|line| line.strip_prefix("loaded "));
    Ok(PathBuf::from(path.ok_or_else(|| text.clone())?))
}

#[test]
fn a_moved_program_finds_a_library() -> Result {
    let folder = tempfile::tempdir()?;
    let folder = folder.path().canonicalize()?;
    let [bin, lib, dir] = ["bin", "lib", "dir"].map(|name| folder.join(name));
    for folder in [&bin, &lib, &dir] {
        fs::create_dir(folder)?;
    }
    let program = bin.join("moved");
    fs::copy(env::current_exe()?, &program)?;
    let of_build = library_path()?;
    // An empty variable is unset, and one that names nothing useful is passed over.
    for useless in ["", "none", "/nonexistent"] {
        assert_eq!(loaded_by(&program, Path::new(useless))?, of_build, "{useless}");
    }
    for place in [&lib, &bin, &dir] {
        let put = place.join("libmujoco.so");
        fs::copy(&of_build, &put)?;
        assert_eq!(loaded_by(&program, &dir)?, put);
    }
    let file = lib.join("libmujoco.so");
    assert_eq!(loaded_by(&program, &file)?, file, "a path to the library itself");
    Ok(())
}
