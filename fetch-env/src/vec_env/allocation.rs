//! Tests: no thread of a vector environment allocates in the steady state.

use std::{hint::black_box, thread};

use allocation_counter::measure;
use fetch_sim::{KinematicSimulator, SimConfig, SimError, Simulator, Task};
use goal_reward::RewardKind;

use super::{
    config::{AutoresetMode, VecConfig},
    env::VecEnv,
    pool::{Job, Pool},
};
use crate::fetch::{config::FetchConfig, env::FetchEnv};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

const NUM_ENVS: usize = 6;
const NUM_THREADS: usize = 3;

/// Counts the allocations of the caller and of all worker threads in `rounds` of steps,
/// autoresets, sends and receipts.
fn allocations<S: Simulator + Send + 'static>(
    simulator: impl Fn(&SimConfig) -> Result<S, SimError>,
    rounds: usize,
) -> Result<[u64; 2]> {
    let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_max_episode_steps(5);
    let mut single = Vec::new();
    for _ in 0..NUM_ENVS {
        let simulator = simulator(&config.sim()?)?;
        single.push(FetchEnv::new(config.clone(), simulator)?.time_limited());
    }
    let same_step = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new(single, same_step)?;
    let (pool, counts) = Pool::counting(NUM_THREADS, NUM_ENVS);
    envs.pool = pool;
    envs.reset(Some(0))?;
    let actions = [0.1; 4 * NUM_ENVS];
    let mut ids = [0; 2];
    let caller = measure(|| {
        for _ in 0..20 * rounds {
            assert_eq!(envs.step(&actions).expect("a step").errors().count(), 0);
        }
        envs.send(&actions, &[0, 1, 2, 3, 4, 5]).expect("idle environments");
        for _ in 0..20 * rounds {
            ids.copy_from_slice(envs.recv(2).expect("a batch").env_ids());
            envs.send(&actions[..8], &ids).expect("idle environments");
        }
        envs.recv(NUM_ENVS).expect("a batch");
    });
    drop(envs);
    Ok([caller.count_total, join(counts)])
}

fn join(counts: Vec<thread::JoinHandle<u64>>) -> u64 {
    counts.into_iter().map(|count| count.join().expect("no panic")).sum()
}

#[test]
fn nothing_is_allocated() -> Result {
    // Further rounds leave out whatever a thread allocates once.
    let once = allocations(|config| Ok(KinematicSimulator::new(config)), 1)?;
    assert_eq!(allocations(|config| Ok(KinematicSimulator::new(config)), 2)?, once);
    assert_eq!(once[0], 0);
    #[cfg(feature = "mujoco")]
    {
        let once = allocations(fetch_sim::MujocoSimulator::new, 1)?;
        assert_eq!(allocations(fetch_sim::MujocoSimulator::new, 2)?, once);
        assert_eq!(once[0], 0);
    }
    Ok(())
}

#[test]
fn the_counting_threads_count() -> Result {
    struct Allocating;
    impl Job for Allocating {
        fn run(&mut self) {
            drop(black_box(vec![0_u8; 10]));
        }
    }
    let (pool, counts) = Pool::counting(1, 3);
    for _ in 0..3 {
        pool.lend(0, Box::new(Allocating));
    }
    pool.wake();
    pool.wait(3)?;
    drop(pool);
    assert_eq!(join(counts), 3);
    Ok(())
}
