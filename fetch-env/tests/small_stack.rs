//! How much of a thread's stack environments need.

use std::{env, hint::black_box, process::Command};

use fetch_env::{
    EnvError, EnvId, FetchEnv,
    vec_env::{VecConfig, VecEnv},
};
use testing::Faulty;
use testing::Result;

/// Marks the process that this test starts.
const CHILD: &str = "FETCH_ENV_TEST_SMALL_STACK";

#[cfg(feature = "mujoco")]
#[test]
fn an_environment_on_mujoco_needs_no_more_than_documented() -> Result {
    use std::thread;

    use fetch_env::{Env, EnvError, make};

    let run = || -> std::result::Result<(), EnvError> {
        for id in EnvId::ALL {
            let mut env = make(id)?;
            env.reset(Some(0))?;
            for _ in 0..50 {
                env.step(&[0.3, -0.5, -1.0, -1.0])?;
            }
        }
        Ok(())
    };
    let thread = thread::Builder::new().stack_size(256 << 10).spawn(run)?;
    Ok(thread.join().expect("no panic")?)
}

#[test]
fn worker_threads_have_room_whatever_the_default_is() -> Result {
    if env::var_os(CHILD).is_some() {
        return step_with_half_a_megabyte();
    }
    let name = "worker_threads_have_room_whatever_the_default_is";
    let child = Command::new(env::current_exe()?)
        .args([name, "--exact", "--test-threads=1"])
        .env(CHILD, "")
        .env("RUST_MIN_STACK", (256 << 10).to_string())
        .output()?;
    assert!(child.status.success(), "{}", String::from_utf8_lossy(&child.stderr));
    Ok(())
}

fn step_with_half_a_megabyte() -> Result {
    let config = "FetchReach-v4".parse::<EnvId>()?.config();
    let env = || {
        let simulator = Faulty::new(config.sim(), || {
            black_box([0_u8; 512 << 10]);
            Ok(())
        });
        Ok::<_, EnvError>(FetchEnv::new(config.clone(), simulator)?.time_limited())
    };
    // One thread would be this one.
    let mut envs = VecEnv::new([env()?, env()?], VecConfig::default().with_num_threads(2))?;
    envs.reset(Some(0))?;
    let batch = envs.step(&[0.0, 0.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0])?;
    assert_eq!(batch.errors().count(), 0);
    Ok(())
}
