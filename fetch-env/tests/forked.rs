//! What happens in a child that is forked from a process with environments.
#![cfg(unix)]

use std::sync::{Mutex, MutexGuard, PoisonError};

use fetch_env::vec_env::{VecConfig, VecEnv, VecEnvError};
use fetch_env::{Env, KinematicEnv, make_kinematic};
use testing::Result;
use testing::in_child;

fn envs(count: usize) -> Result<VecEnv<KinematicEnv>> {
    let envs = (0..count).map(|_| make_kinematic("FetchPush-v4"));
    let config = VecConfig::default().with_num_threads(2);
    Ok(VecEnv::new(envs.collect::<Result<Vec<_>, _>>()?, config)?)
}

/// Keeps the tests of this process apart: Rust locks a list while it starts a thread, and a child that
/// is forked meanwhile cannot start any.
fn alone() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    ALONE.lock().unwrap_or_else(PoisonError::into_inner)
}

const ACTIONS: [f32; 16] = [0.3; 16];

#[test]
fn a_vector_from_before_the_fork_says_so_and_a_new_one_works() -> Result {
    let _alone = alone();
    let mut before = envs(4)?;
    before.reset(Some(0))?;
    let observation = before.step(&ACTIONS)?.observation().to_vec();
    let snapshot = before.snapshot()?;
    in_child(|| {
        let forked = Some(VecEnvError::Forked);
        assert_eq!(before.step(&ACTIONS).err(), forked);
        assert_eq!(before.reset(Some(0)).err(), forked);
        assert_eq!(before.send(&ACTIONS, &[0, 1, 2, 3]).err(), forked);
        assert_eq!(before.send_reset(Some(0)).err(), forked);
        assert_eq!(before.recv(0).err(), forked);
        assert_eq!(before.snapshot().err(), forked);
        assert_eq!(before.restore(&snapshot).err(), forked);
        assert_eq!((before.in_flight(), before.last_step().observation()), (0, &observation[..]));
        let mut new = envs(4)?;
        new.reset(Some(0))?;
        assert_eq!(new.step(&ACTIONS)?.observation(), observation);
        drop(before);
        Ok(())
    })
}

#[test]
fn a_vector_is_dropped_in_the_child_and_goes_on_in_the_parent() -> Result {
    let _alone = alone();
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
    let _alone = alone();
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

#[cfg(feature = "render")]
#[test]
fn pictures_are_an_error_in_the_child_and_no_lock_is_waited_for() -> Result {
    let _alone = alone();
    use fetch_env::{AddRenderObservation, EnvError, EnvExt, PixelOptions, RenderError, make};

    let new = || make("FetchReach-v4")?.wrap(AddRenderObservation::new(PixelOptions::default()));
    let mut env = match new() {
        Err(error) if matches!(error.downcast_ref(), Some(RenderError::NoOpenGl { .. })) => {
            return Ok(());
        }
        made => Some(made?),
    };
    env.iter_mut().try_for_each(|env| env.reset(Some(0)).map(drop))?;
    let config = VecConfig::default().with_num_threads(2);
    let mut envs = VecEnv::new([new()?, new()?], config)?;
    envs.reset(Some(0))?;
    for _ in 0..10 {
        // The threads draw, and borrow renderers, while the process is forked.
        envs.send(&ACTIONS[..8], &[0, 1])?;
        in_child(|| {
            let mut env = env.take().ok_or("it is the parent's copy")?;
            let forked = EnvError::from(RenderError::Forked);
            assert_eq!(env.step(&ACTIONS[..4]), Err(forked.clone()));
            assert_eq!(env.step(&ACTIONS[..4]), Err(EnvError::ResetNeeded));
            assert_eq!(env.reset(Some(0)), Err(forked.clone()));
            let plain = env.into_inner();
            assert_eq!(
                plain.wrap(AddRenderObservation::new(PixelOptions::default())).err(),
                Some(forked)
            );
            Ok(())
        })?;
        envs.recv(2)?;
    }
    env.ok_or("the parent has it")?.step(&ACTIONS[..4])?;
    Ok(())
}
