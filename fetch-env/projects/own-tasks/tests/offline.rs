//! Offline learning: one process writes the episodes, and another one learns from their file.

use std::error::Error;
use std::ffi::OsStr;
use std::process::Command;

type Result<T = ()> = std::result::Result<T, Box<dyn Error>>;

/// Runs the example in its own process, and returns what it prints.
fn offline(arguments: &[&OsStr]) -> Result<String> {
    let mut command = Command::new(env!("CARGO"));
    command.args(["run", "--quiet", "--example", "offline", "--"]).args(arguments);
    let output = command.current_dir(env!("CARGO_MANIFEST_DIR")).output()?;
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {errors}");
    Ok(String::from_utf8(output.stdout)?)
}

#[test]
fn a_file_of_scripted_episodes_is_enough_to_learn_from() -> Result {
    let folder = tempfile::tempdir()?;
    let file = folder.path().join("episodes.buffer");
    offline(&["collect".as_ref(), file.as_ref()])?;
    let learned = offline(&["learn".as_ref(), file.as_ref()])?;
    let (_, rate) = learned.rsplit_once("success rate ").ok_or("no success rate")?;
    let rate: f64 = rate.trim().parse()?;
    assert!(rate >= 0.85, "{learned}");
    Ok(())
}
