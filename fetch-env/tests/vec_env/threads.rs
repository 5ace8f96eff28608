//! Which thread steps the environments.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread::{self, ThreadId},
};

use fetch_env::{FetchResetOptions, vec_env::AutoresetMode, vec_env::VecConfig};

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
