//! No thread allocates in the steady state, as a counting allocator sees it.

use std::alloc::System;

use fetch_env::{
    EnvId, FetchEnv, TimeLimit,
    vec_env::{AutoresetMode, VecConfig, VecEnv},
};
use fetch_sim::{KinematicSimulator, Simulator};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn is_free_of_allocation<S: Simulator + Send + 'static>(simulator: impl Fn(EnvId) -> S) {
    const COUNT: usize = 6;
    let id: EnvId = "FetchPush-v4".parse().expect("an id");
    let make = |_| {
        let env = FetchEnv::new(id.config(), simulator(id)).expect("a fitting simulator");
        TimeLimit::new(env, 5.try_into().expect("not 0"))
    };
    let config = VecConfig::default().threads(3).autoreset(AutoresetMode::SameStep);
    let mut envs = VecEnv::new((0..COUNT).map(make), config).expect("a vector");
    envs.reset(Some(0)).expect("a reset");
    let actions = [0.1; 4 * COUNT];
    let mut ids = [0; 2];
    // Steps, autoresets, sends and receipts: the first time for whatever is made once a thread.
    for counted in [false, true] {
        let region = Region::new(ALLOCATOR);
        for _ in 0..20 {
            assert_eq!(envs.step(&actions).expect("a step").errors().count(), 0);
        }
        envs.send(&actions, &[0, 1, 2, 3, 4, 5]).expect("idle environments");
        for _ in 0..20 {
            ids.copy_from_slice(envs.recv(2).expect("a batch").env_ids());
            envs.send(&actions[..8], &ids).expect("idle environments");
        }
        envs.recv(COUNT).expect("a batch");
        let change = region.change();
        assert!(!counted || change.allocations + change.reallocations == 0, "{change:?}");
    }
}

/// One test, because the allocator counts for all threads of the process.
#[test]
fn nothing_is_allocated() {
    is_free_of_allocation(|id| KinematicSimulator::new(id.config().sim()));
    #[cfg(feature = "mujoco")]
    is_free_of_allocation(|id| fetch_sim::MujocoSimulator::new(id.config().sim()).expect("MuJoCo"));
    let region = Region::new(ALLOCATOR);
    drop(std::hint::black_box(vec![0_u8; 10]));
    assert_eq!(region.change().allocations, 1, "the allocator counts");
}
