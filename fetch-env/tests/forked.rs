//! What a child meets that a process with environments forks.
#![cfg(unix)]
#![allow(clippy::exit, reason = "a forked child must not return to the harness")]

use std::{
    os::unix::process::ExitStatusExt,
    panic::{AssertUnwindSafe, catch_unwind},
    process::{ExitStatus, abort, exit},
    thread,
    time::Duration,
};

use fetch_env::vec_env::{VecConfig, VecEnv, VecEnvError, VecReset};
use fetch_env::{Env, KinematicEnv, make_kinematic};
use fork::{Fork, fork, waitpid};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Longer than any call here takes: a child that waits forever is ended then.
const FOREVER: Duration = Duration::from_secs(60);

/// Runs a part of a test in a forked child, and fails if that fails or hangs.
fn in_child(part: impl FnOnce() -> Result) -> Result {
    match fork()? {
        Fork::Parent(child) => {
            let status = ExitStatus::from_raw(waitpid(child)?);
            if status.success() { Ok(()) } else { Err(format!("the child: {status}").into()) }
        }
        Fork::Child => {
            thread::spawn(|| {
                thread::sleep(FOREVER);
                abort();
            });
            let result = catch_unwind(AssertUnwindSafe(|| part().expect("no error in the child")));
            exit(i32::from(result.is_err()));
        }
    }
}

fn envs(count: usize) -> Result<VecEnv<KinematicEnv>> {
    let envs = (0..count).map(|_| make_kinematic("FetchPush-v4"));
    let config = VecConfig::default().with_num_threads(2);
    Ok(VecEnv::new(envs.collect::<Result<Vec<_>, _>>()?, config)?)
}

const ACTIONS: [f32; 16] = [0.3; 16];

#[test]
fn a_vector_from_before_the_fork_says_so_and_a_new_one_works() -> Result {
    let mut before = envs(4)?;
    before.reset(Some(0))?;
    let observation = before.step(&ACTIONS)?.observation().to_vec();
    let snapshot = before.snapshot()?;
    in_child(|| {
        let forked = Some(VecEnvError::Forked);
        assert_eq!(before.step(&ACTIONS).err(), forked);
        assert_eq!(before.reset(Some(0)).err(), forked);
        assert_eq!(before.send(&ACTIONS, &[0, 1, 2, 3]).err(), forked);
        assert_eq!(before.send_reset(&VecReset::seeded(0)).err(), forked);
        assert_eq!(before.recv(0).err(), forked);
        assert_eq!(before.snapshot().err(), forked);
        assert_eq!(before.restore(&snapshot).err(), forked);
        assert_eq!((before.in_flight(), before.batch().observation()), (0, &observation[..]));
        let mut new = envs(4)?;
        new.reset(Some(0))?;
        assert_eq!(new.step(&ACTIONS)?.observation(), observation);
        drop(before);
        Ok(())
    })
}

#[test]
fn a_vector_is_dropped_in_the_child_and_goes_on_in_the_parent() -> Result {
    let (mut forked, mut plain) = (Some(envs(4)?), envs(4)?);
    for envs in forked.iter_mut().chain([&mut plain]) {
        envs.reset(Some(0))?;
    }
    for _ in 0..20 {
        for envs in forked.iter_mut().chain([&mut plain]) {
            envs.send(&ACTIONS, &[0, 1, 2, 3])?;
        }
        // The threads may be anywhere in their work.
        in_child(|| {
            drop(forked.take());
            Ok(())
        })?;
        for envs in forked.iter_mut().chain([&mut plain]) {
            envs.recv(4)?;
        }
    }
    let mut forked = forked.ok_or("the parent still has it")?;
    assert_eq!(forked.step(&ACTIONS)?.observation(), plain.step(&ACTIONS)?.observation());
    Ok(())
}

#[test]
fn a_single_environment_goes_on_in_both() -> Result {
    let (mut env, mut plain) = (make_kinematic("FetchPush-v4")?, make_kinematic("FetchPush-v4")?);
    assert_eq!(env.reset(Some(0))?, plain.reset(Some(0))?);
    let expected = plain.step(&ACTIONS[..4])?;
    in_child(|| {
        assert_eq!(env.step(&ACTIONS[..4])?, expected);
        Ok(())
    })?;
    assert_eq!(env.step(&ACTIONS[..4])?, expected);
    Ok(())
}
