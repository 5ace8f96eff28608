//! Instructions of the hot path, counted by valgrind and so the same on a busy machine:
//! `cargo bench -p fetch-env --bench instructions`, after `cargo install gungraun-runner`.
//!
//! `env` less `physics`, divided by `env`, is what everything above the physics costs.
// What the macros make.
#![allow(missing_docs, unreachable_pub, unused_qualifications, clippy::exit)]

use std::hint::black_box;

use fetch_env::{Env, EnvId, GoalEnv, MujocoEnv, make_config};
use fetch_sim::Data;
use goal_reward::{DistanceReward, GoalPairs, GoalReward};
use gungraun::{library_benchmark, library_benchmark_group, main};
use nalgebra::{Quaternion, Vector3};

const ACTION: [f32; 4] = [0.3, -0.2, 0.1, 0.5];

fn env(id: &str) -> MujocoEnv {
    let id: EnvId = id.parse().expect("an id");
    let mut env = make_config(id.config()).expect("MuJoCo");
    env.reset(Some(0)).expect("a reset");
    // The first step resolves MuJoCo's symbols.
    env.step(&ACTION).expect("a step");
    env.reset(Some(0)).expect("a reset");
    env
}

/// The same physics as [`env`]'s next step, of which nothing has been done yet.
fn physics(id: &str) -> Data {
    let env = env(id);
    let simulator = env.inner().simulator();
    let model = simulator.fetch_model().model();
    let mut data = Data::new(model.clone()).expect("memory");
    data.qpos_mut().copy_from_slice(simulator.data().qpos());
    data.qvel_mut().copy_from_slice(simulator.data().qvel());
    data.forward().expect("a stable state");
    let gripper = model.body("robot0:gripper_link").expect("a body");
    let mocap = model.body("robot0:mocap").expect("a body");
    let (position, orientation) = data.body_pose(gripper);
    let [x, y, z] = [0, 1, 2].map(|axis| f64::from(ACTION[axis] * 0.05));
    let target = position + Vector3::new(x, y, z);
    let down = Quaternion::new(1.0, 0.0, 1.0, 0.0);
    data.set_mocap_pose(
        model.mocap_index(mocap).expect("a mocap body"),
        target,
        orientation + down,
    );
    data.ctrl_mut().fill(f64::from(ACTION[3]));
    data
}

#[library_benchmark(setup = env)]
#[bench::reach("FetchReach-v4")]
#[bench::push("FetchPush-v4")]
#[bench::pick_and_place("FetchPickAndPlace-v4")]
#[bench::slide("FetchSlide-v4")]
fn env_step(mut env: MujocoEnv) -> MujocoEnv {
    black_box(env.step(black_box(&ACTION)).expect("a step"));
    env
}

#[library_benchmark(setup = physics)]
#[bench::reach("FetchReach-v4")]
#[bench::push("FetchPush-v4")]
#[bench::slide("FetchSlide-v4")]
fn physics_and_forward(mut data: Data) -> Data {
    data.step(20).expect("a stable state");
    data.forward().expect("a stable state");
    data
}

#[library_benchmark(setup = physics)]
#[bench::pick_and_place("FetchPickAndPlace-v4")]
fn physics_alone(mut data: Data) -> Data {
    data.step(20).expect("a stable state");
    data
}

#[library_benchmark(setup = env)]
#[bench::push("FetchPush-v4")]
fn env_reset(mut env: MujocoEnv) -> MujocoEnv {
    black_box(env.reset(None).expect("a reset"));
    env
}

#[library_benchmark(setup = env)]
#[bench::push("FetchPush-v4")]
fn observation(env: MujocoEnv) -> MujocoEnv {
    black_box(black_box(&env).inner().observe().expect("an observation"));
    env
}

#[library_benchmark(setup = env)]
#[bench::push("FetchPush-v4")]
fn compute_reward(env: MujocoEnv) -> MujocoEnv {
    let reward = env.compute_reward(black_box(&[1.3, 0.7, 0.4]), black_box(&[1.2, 0.8, 0.4]));
    let _ = black_box(reward);
    env
}

fn goals() -> [Vec<f64>; 3] {
    [vec![0.1; 3000], vec![0.2; 3000], vec![0.0; 1000]]
}

#[library_benchmark]
#[bench::thousand(args = (), setup = goals)]
fn reward_batch([achieved, desired, mut rewards]: [Vec<f64>; 3]) -> Vec<f64> {
    let pairs = GoalPairs::new(&achieved, &desired, 3).expect("matrices");
    DistanceReward::sparse().reward_batch(black_box(pairs), &mut rewards).expect("enough room");
    rewards
}

library_benchmark_group!(
    name = hot_path,
    benchmarks = [
        env_step,
        physics_and_forward,
        physics_alone,
        env_reset,
        observation,
        compute_reward,
        reward_batch
    ]
);

main!(library_benchmark_groups = hot_path);
