//! Invalid calls are errors and change nothing.

use fetch_env::{
    Env, EnvError, FetchResetOptions, make_kinematic,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecEnvError, VecReset},
};

use crate::common::{Result, actions, rows, vec_env};

type Options = FetchResetOptions;

#[test]
fn wrong_sizes_are_errors() -> Result {
    let mut envs = vec_env(3, VecConfig::default())?;
    let start = rows(envs.reset(Some(0))?);
    for actual in [0, 4, 11, 13, 16] {
        let error = VecEnvError::ActionCount { rows: 3, action_len: 4, actual };
        assert_eq!(envs.step(&vec![0.0; actual]).err(), Some(error.clone()));
        assert_eq!(envs.send(&vec![0.0; actual], &[0, 1, 2]), Err(error));
    }
    let count = |what, actual| VecEnvError::Count { what, actual, num_envs: 3 };
    let reset = |mask| VecReset { mask: Some(mask), ..VecReset::<Options>::default() };
    for (wrong, error) in [
        (VecReset { seeds: Some(&[None; 2]), ..VecReset::default() }, count("seeds", 2)),
        (reset(&[true; 4]), count("mask", 4)),
        (reset(&[false; 3]), VecEnvError::EmptyMask),
    ] {
        assert_eq!(envs.send_reset_with(&wrong), Err(error.clone()));
        assert_eq!(envs.reset_with(&wrong).err(), Some(error));
    }
    let first = u64::MAX - 1;
    let too_large = VecEnvError::SeedTooLarge { first, num_envs: 3 };
    assert_eq!(envs.send_reset(Some(first)), Err(too_large.clone()));
    assert_eq!(envs.reset(Some(first)).err(), Some(too_large));
    assert_eq!(rows(envs.last_step()), start);
    assert_eq!(envs.in_flight(), 0);
    envs.reset(Some(u64::MAX - 2))?;
    Ok(())
}

#[test]
fn wrong_ids_are_errors() -> Result {
    let mut envs = vec_env(3, VecConfig::default())?;
    envs.reset(Some(0))?;
    let unknown = VecEnvError::UnknownEnv { env_index: 3, num_envs: 3 };
    assert_eq!(envs.send(&[0.0; 8], &[0, 3]), Err(unknown));
    let twice = VecEnvError::EnvInFlight { env_index: 1 };
    assert_eq!(envs.send(&[0.0; 8], &[1, 1]), Err(twice.clone()));
    assert_eq!(envs.in_flight(), 0);

    envs.send(&[0.0; 8], &[1, 2])?;
    assert_eq!(envs.send(&[0.0; 8], &[0, 1]), Err(twice.clone()));
    assert_eq!(envs.send_reset_with(&VecReset::default()), Err(twice));
    let busy = VecEnvError::InFlight { count: 2 };
    assert_eq!(envs.step(&[0.0; 12]).err(), Some(busy.clone()));
    assert_eq!(envs.reset(None).err(), Some(busy));
    assert!(envs.env(0).is_some() && envs.env(1).is_none() && envs.env(3).is_none());
    let too_large = VecEnvError::BatchTooLarge { batch_size: 3, in_flight: 2 };
    assert_eq!(envs.recv(3).err(), Some(too_large));
    assert_eq!(envs.recv(0)?.len(), 0);
    assert_eq!(envs.recv(2)?.len(), 2);
    envs.step(&[0.0; 12])?;
    Ok(())
}

#[test]
fn environments_that_do_not_make_a_batch_are_refused() -> Result {
    let none: [fetch_env::KinematicEnv; 0] = [];
    assert_eq!(VecEnv::new(none, VecConfig::default()).err(), Some(VecEnvError::NoEnvs));
    let mixed = ["FetchPush-v4", "FetchSlide-v4", "FetchReach-v4"].map(make_kinematic);
    let mixed = mixed.into_iter().collect::<std::result::Result<Vec<_>, _>>()?;
    let differ = VecEnvError::SpacesDiffer { env_index: 2 };
    assert_eq!(VecEnv::new(mixed, VecConfig::default()).err(), Some(differ));
    Ok(())
}

#[test]
fn there_are_never_more_threads_than_environments() -> Result {
    for (threads, expected) in [(1, 1), (3, 3), (4, 3), (100, 3)] {
        assert_eq!(
            vec_env(3, VecConfig::default().with_num_threads(threads))?.num_threads(),
            expected
        );
    }
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    assert_eq!(vec_env(64, VecConfig::default().with_num_threads(0))?.num_threads(), cores.min(64));
    Ok(())
}

#[test]
fn pinned_threads_work_or_say_that_they_cannot() -> Result {
    let made =
        VecEnv::new(make_kinematic("FetchPush-v4"), VecConfig::default().with_pin_threads(true));
    match made {
        Ok(mut envs) => assert_eq!(envs.reset(Some(0))?.len(), 1),
        Err(error) => assert_eq!(error, VecEnvError::Pinning),
    }
    Ok(())
}

#[test]
fn a_step_before_the_reset_is_refused() -> Result {
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep, AutoresetMode::Disabled] {
        let mut envs = vec_env(2, VecConfig::default().with_autoreset(mode))?;
        let new = envs.snapshot()?;
        let needed = |env_index| Some(VecEnvError::ResetNeeded { env_index });
        for _ in 0..2 {
            assert_eq!(envs.step(&actions(2, 0)).err(), needed(0));
            assert_eq!(envs.send(&actions(1, 0), &[1]).err(), needed(1));
            assert_eq!(envs.in_flight(), 0);
            // A reset behind the vector's back shows no observation to act on.
            envs.env_mut(0).ok_or("it is idle")?.reset(Some(0))?;
        }
        // An environment that was reset waits for the others.
        let first = VecReset { mask: Some(&[true, false]), ..VecReset::default() };
        envs.reset_with(&first)?;
        assert_eq!(envs.step(&actions(2, 0)).err(), needed(1));
        envs.send(&actions(1, 0), &[0])?;
        assert!(envs.recv(1)?.stepped()[0]);
        envs.reset(Some(0))?;
        assert_eq!(envs.step(&actions(2, 0))?.errors().count(), 0);
        let running = envs.snapshot()?;
        envs.restore(&new)?;
        assert_eq!(envs.step(&actions(2, 0)).err(), needed(0));
        let mut other = vec_env(2, VecConfig::default().with_autoreset(mode))?;
        other.restore(&running)?;
        assert_eq!(other.step(&actions(2, 1))?.errors().count(), 0);
    }
    Ok(())
}

#[test]
fn without_autoreset_a_step_after_the_end_is_an_error_in_its_row() -> Result {
    let mut envs = vec_env(2, VecConfig::default().with_autoreset(AutoresetMode::Disabled))?;
    envs.reset(Some(0))?;
    for step in 0..5 {
        envs.step(&actions(2, step))?;
    }
    let batch = envs.step(&actions(2, 5))?;
    assert_eq!(batch.errors().collect::<Vec<_>>(), [(0, &EnvError::EpisodeOver)]);
    let reset = VecReset { mask: Some(&[true, false]), ..VecReset::default() };
    envs.reset_with(&reset)?;
    assert_eq!(envs.step(&actions(2, 6))?.errors().count(), 0);
    Ok(())
}
