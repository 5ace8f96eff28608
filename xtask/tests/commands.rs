//! The task runner as a user runs it, without building the lab.

use std::{
    error::Error,
    fs,
    process::{Command, Output},
};

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

const RECORDING: &str =
    concat!(env!("CARGO_MANIFEST_DIR"), "/lab/tests/recordings/mujoco-2.2.2/reach-still.npz");

fn xtask(arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_xtask"));
    command.args(arguments.split_whitespace());
    command
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn help_lists_every_command() -> Result {
    let output = xtask("--help").output()?;
    assert_eq!(output.status.code(), Some(0));
    for name in ["verify", "doctor", "random-episodes", "assets", "mujoco", "fuzz", "ci"] {
        assert!(stdout(&output).contains(&format!("\n  {name} ")), "{name}");
    }
    for arguments in ["help mujoco", "mujoco --help"] {
        let output = xtask(arguments).output()?;
        assert_eq!(output.status.code(), Some(0), "{arguments}");
        assert!(stdout(&output).contains("Usage: cargo xtask mujoco [--from <WHEEL>] <VERSION>"));
    }
    Ok(())
}

#[test]
fn wrong_usage_is_exit_code_2() -> Result {
    for arguments in [
        "",
        "nothing",
        "help nothing",
        "ci now",
        "assets here",
        "mujoco",
        "mujoco 3.6",
        "mujoco 3.6.0 3.7.0",
        "fuzz --seconds 0",
        "fuzz --target nothing",
    ] {
        let output = xtask(arguments).output()?;
        assert_eq!(output.status.code(), Some(2), "{arguments}: {}", stderr(&output));
    }
    Ok(())
}

#[test]
fn without_mujoco_doctor_names_the_problem_and_the_fix() -> Result {
    let output = xtask("doctor").env("MUJOCO_DIR", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    let text = stdout(&output);
    assert!(text.starts_with("FAIL  MuJoCo is missing\n"), "{text}");
    assert!(text.contains("/nonexistent") && text.contains("      fix: apt-get"), "{text}");

    let output = xtask("verify").env("MUJOCO_DIR", "/nonexistent").output()?;
    assert_eq!(output.status.code(), Some(1));
    assert!(stderr(&output).contains("cargo xtask mujoco 3.6.0"), "{}", stderr(&output));
    Ok(())
}

#[test]
fn a_foreign_or_damaged_wheel_leaves_the_cache_as_it_was() -> Result {
    let folder = tempfile::tempdir()?;
    let cache = folder.path().join("cache");
    fs::create_dir(&cache)?;
    fs::write(cache.join("kept"), "as it was")?;
    let wheel = folder.path().join("foreign.whl");
    // An archive of something else, and then a file that is no archive.
    for contents in [fs::read(RECORDING)?, b"no archive".to_vec()] {
        fs::write(&wheel, contents)?;
        let output = xtask("assets --from").arg(&wheel).env("FETCH_ASSETS_DIR", &cache).output()?;
        assert_eq!(output.status.code(), Some(1));
        assert!(stderr(&output).contains("foreign.whl"), "{}", stderr(&output));
        assert_eq!(fs::read_to_string(cache.join("kept"))?, "as it was");
        assert_eq!(fs::read_dir(folder.path())?.count(), 2, "nothing left over");
    }
    Ok(())
}
