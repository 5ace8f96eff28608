//! Environments are made in children of a process whose other threads make some all the time.
//!
//! The only test of its process: Rust locks a list while it starts a thread, as other tests would, and a
//! child that is forked meanwhile cannot start any.
#![cfg(all(unix, feature = "mujoco"))]

use std::sync::{
    Barrier,
    atomic::{AtomicBool, Ordering::SeqCst},
};

use fetch_env::vec_env::VecConfig;
use fetch_env::{Env, FetchConfig, RewardKind, Task, make, make_vec};
use testing::{Result, in_child};

#[test]
fn environments_are_made_in_a_child_whatever_other_threads_make() -> Result {
    let config = || FetchConfig::new(Task::Reach, RewardKind::Sparse);
    let (done, begun) = (AtomicBool::new(false), Barrier::new(3));
    // Each makes the only environment of its substeps, and so compiles and settles a model.
    let make_other = |substeps: u32| -> Result<(), String> {
        begun.wait();
        while !done.load(SeqCst) {
            let other = config().with_n_substeps(substeps).map_err(|error| error.to_string())?;
            make(other).map_err(|error| error.to_string())?;
        }
        Ok(())
    };
    std::thread::scope(|scope| {
        let others = [1, 2].map(|substeps| scope.spawn(move || make_other(substeps)));
        begun.wait();
        let children = (0..20).try_for_each(|_| {
            in_child(|| {
                make(config())?.reset(Some(0))?;
                let mut envs = make_vec(config(), 4, VecConfig::default().with_num_threads(2))?;
                envs.reset(Some(0))?;
                envs.step(&[0.3; 16])?;
                // A child has children, too.
                in_child(|| Ok(make(config())?.reset(Some(0)).map(drop)?))
            })
        });
        done.store(true, SeqCst);
        others.into_iter().try_for_each(|other| other.join().expect("no panic"))?;
        children
    })
}
