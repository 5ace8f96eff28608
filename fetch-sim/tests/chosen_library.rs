//! A library that the program brings. The choice holds for the whole process, so this is one test.
#![cfg(all(unix, feature = "mujoco", not(fetch_sim_no_shim)))]

use std::{
    env,
    fs::{self, Permissions},
    os::unix::fs::PermissionsExt,
    process::Command,
};

use fetch_sim::{MujocoSimulator, SimConfig, SimError, Task, library_path, use_library};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const CHOSEN: &str = "FETCH_SIM_TEST_CHOSEN_LIBRARY";

#[test]
fn the_library_that_a_program_brings_is_taken() -> Result {
    if let Some(chosen) = env::var_os(CHOSEN) {
        use_library(&chosen)?;
        use_library(&chosen)?;
        let refused = use_library("/elsewhere/libmujoco.so");
        assert_eq!(refused, Err(SimError::LibraryInUse { path: chosen.clone().into() }));
        assert_eq!(library_path()?, fs::canonicalize(&chosen)?);
        use_library(&chosen)?;
        MujocoSimulator::new(&SimConfig::new(Task::Push))?;
        return Ok(());
    }
    // In another process, because this one has loaded the library.
    let folder = tempfile::tempdir()?;
    let chosen = folder.path().join("libbrought.so");
    fs::copy(library_path()?, &chosen)?;
    fs::set_permissions(&chosen, Permissions::from_mode(0o777))?;
    assert!(matches!(use_library(&chosen), Err(SimError::LibraryInUse { .. })));
    let run = |variable: &str| {
        Command::new(env::current_exe()?).env(CHOSEN, &chosen).env(variable, "/nowhere").output()
    };
    let output = run("MUJOCO_DIR")?;
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    fs::write(&chosen, "no library")?;
    let output = run("UNUSED")?;
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("the program's choice") && text.contains("damaged"), "{text}");
    Ok(())
}
