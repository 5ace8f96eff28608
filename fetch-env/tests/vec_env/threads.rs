//! Which thread steps the environments.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread::{self, ThreadId},
};

use fetch_env::{
    FetchResetOptions, make_kinematic,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecEnvError},
};

use crate::common::{Result, actions, rows, vec_env};

/// Returns the threads on which the autoresets of an episode ran.
fn threads_of_autoresets(num_threads: usize) -> Result<Vec<ThreadId>> {
    let config =
        VecConfig::default().with_num_threads(num_threads).with_autoreset(AutoresetMode::SameStep);
    let mut envs = vec_env(3, config)?;
    let threads = Arc::new(Mutex::new(Vec::new()));
    let noted = Arc::clone(&threads);
    envs.set_autoreset_start(move |_, _| {
        noted.lock().unwrap_or_else(PoisonError::into_inner).push(thread::current().id());
        (None, FetchResetOptions::default())
    })?;
    envs.reset(Some(0))?;
    for step in 0..50 {
        envs.step(&actions(3, step))?;
    }
    let threads = threads.lock().map_err(|error| error.to_string())?.clone();
    Ok(threads)
}

#[test]
fn one_thread_is_the_callers() -> Result {
    let caller = thread::current().id();
    let threads = threads_of_autoresets(1)?;
    assert!(threads.len() >= 3 && threads.iter().all(|thread| *thread == caller), "{threads:?}");
    let threads = threads_of_autoresets(2)?;
    assert!(threads.len() >= 3 && !threads.contains(&caller), "{threads:?}");
    Ok(())
}

#[test]
fn more_threads_than_any_machine_has_are_refused_before_they_start() -> Result {
    let threads = |num_threads| VecConfig::default().with_num_threads(num_threads);
    // There are never more than environments.
    assert_eq!(vec_env(3, threads(usize::MAX))?.num_threads(), 3);
    for num_threads in [1025, usize::MAX] {
        let envs = (0..1025).map(|_| make_kinematic("FetchReach-v4"));
        let envs = envs.collect::<Result<Vec<_>, _>>()?;
        let refused = VecEnv::new(envs, threads(num_threads)).err();
        assert_eq!(refused, Some(VecEnvError::TooManyThreads { threads: 1025, most: 1024 }));
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
fn make_vec_starts_no_threads_that_the_vector_refuses() {
    let config = VecConfig::default().with_num_threads(20_000);
    let refused = fetch_env::make_vec("FetchReach-v4", 20_000, config).err();
    let expected = VecEnvError::TooManyThreads { threads: 20_000, most: 1024 };
    assert_eq!(refused, Some(expected.into()));
}

#[test]
fn what_is_sent_is_received_in_order() -> Result {
    for num_threads in [1, 3] {
        let config = VecConfig::default().with_num_threads(num_threads);
        let (mut envs, mut stepped) = (vec_env(5, config)?, vec_env(5, config)?);
        envs.send_reset(Some(7))?;
        assert_eq!(rows(envs.recv_all()?), rows(stepped.reset(Some(7))?));
        for step in 0..60 {
            // Backward, so that the order is not that of sending.
            let backward: Vec<_> = actions(5, step).chunks(4).rev().flatten().copied().collect();
            envs.send(&backward, &[4, 3, 2, 1, 0])?;
            assert_eq!(rows(envs.recv_all()?), rows(stepped.step(&actions(5, step))?));
            assert_eq!(envs.last_step().env_index(), [0, 1, 2, 3, 4]);
        }
        let last = envs.recv_all()?;
        assert!(last.len() == 5 && !last.stepped().contains(&true));
    }
    Ok(())
}
