//! What happens when memory runs out while MuJoCo compiles a model.
#![cfg(all(
    target_os = "linux",
    target_arch = "x86_64",
    feature = "mujoco",
    not(fetch_sim_no_shim)
))]

use std::{env, os::unix::process::ExitStatusExt, process::Command};

use fetch_sim::{Model, MujocoVersion, SimError};
use testing::Result;

/// Marks the process that a test starts.
const CHILD: &str = "FETCH_SIM_TEST_OUT_OF_MEMORY";

const ABORTED: i32 = 6;

/// Compiles a model in a process that has 2 GB, and returns how that ended.
fn compile_with_little_memory(test: &str) -> Result<(Option<i32>, String)> {
    let child = Command::new("sh")
        .args(["-c", r#"ulimit -c 0; ulimit -v 2000000; exec "$0" "$@""#])
        .arg(env::current_exe()?)
        .args([test, "--exact", "--nocapture", "--test-threads=1"])
        .env(CHILD, "")
        .output()?;
    Ok((child.status.signal(), String::from_utf8_lossy(&child.stderr).into_owned()))
}

fn compile(xml: &str) -> Result<Model, SimError> {
    Model::from_files(&[("model.xml", xml)])
}

#[test]
fn an_exception_of_mujocos_ends_the_process_where_it_is_thrown() -> Result {
    if env::var_os(CHILD).is_some() {
        // 4 GB for each body.
        let bodies = "<body/>".repeat(2);
        return Ok(compile(&format!(
            r#"<mujoco><size nuser_body="500000000"/><worldbody>{bodies}</worldbody></mujoco>"#
        ))
        .map(drop)?);
    }
    let name = "an_exception_of_mujocos_ends_the_process_where_it_is_thrown";
    let (signal, message) = compile_with_little_memory(name)?;
    assert_eq!(signal, Some(ABORTED), "{message}");
    // No frame of Rust's has seen it.
    assert!(message.contains("std::bad_alloc") && !message.contains("foreign"), "{message}");
    Ok(())
}

#[test]
fn memory_that_mujoco_asks_of_c_is_an_error() -> Result {
    if env::var_os(CHILD).is_some() {
        let is_old = MujocoVersion::of_library()?.to_string().starts_with("2.");
        let size = if is_old { r#"nstack="1000000000""# } else { r#"memory="8G""# };
        let refused = compile(&format!("<mujoco><size {size}/></mujoco>"));
        assert!(matches!(refused, Err(SimError::Model { .. })), "{refused:?}");
        return Ok(());
    }
    let (signal, message) = compile_with_little_memory("memory_that_mujoco_asks_of_c_is_an_error")?;
    assert_eq!((signal, message.contains("panicked")), (None, false), "{message}");
    Ok(())
}
