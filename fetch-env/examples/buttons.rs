//! A task that remembers: touch button A with the gripper, then go to button B.
//!
//! A goal has 4 elements: a position in meters, and whether A has been touched (0 or 1). The reward
//! is then a function of the two goals, as it must be, and the usual one does.
//!
//! `cargo run -p fetch-env --example buttons`
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;

use fetch_env::{
    DistanceReward, Env, EnvError, FetchConfig, FetchEnv, FetchObservation, FetchTask,
    GoalObservation, MujocoEnv, NpRandom, RewardKind, Simulator, Task,
};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// How near the gripper must come to A, in meters.
const NEAR: f64 = 0.05;

#[derive(Clone, Debug)]
struct Buttons;

/// What the simulator's state does not say.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Memory {
    a: Vector3<f64>,
    is_touched: bool,
}

impl<S: Simulator> FetchTask<S> for Buttons {
    type Memory = Memory;

    fn goal_len(&self) -> usize {
        4
    }

    /// The way to A.
    fn extra_len(&self) -> usize {
        3
    }

    fn begin_episode(
        &self,
        config: &FetchConfig,
        simulator: &mut S,
        random: &mut NpRandom,
        desired_goal: &mut [f64],
    ) -> Result<Memory, EnvError> {
        let (start, range) = (simulator.settled().gripper_position, config.target_range());
        let [a, b] = [(); 2].map(|()| start.map(|center| center + random.uniform(-range, range)));
        desired_goal.copy_from_slice(&[b.x, b.y, b.z, 1.0]);
        Ok(Memory { a, is_touched: false })
    }

    fn remember(&self, simulator: &S, memory: &mut Memory) -> Result<(), EnvError> {
        memory.is_touched |= (simulator.gripper().position - memory.a).norm() < NEAR;
        Ok(())
    }

    fn achieved_goal(
        &self,
        simulator: &S,
        memory: &Memory,
        goal: &mut [f64],
    ) -> Result<(), EnvError> {
        goal[..3].copy_from_slice(simulator.gripper().position.as_slice());
        goal[3] = f64::from(memory.is_touched);
        Ok(())
    }

    fn observe_extra(
        &self,
        simulator: &S,
        memory: &Memory,
        extra: &mut [f64],
    ) -> Result<(), EnvError> {
        extra.copy_from_slice((memory.a - simulator.gripper().position).as_slice());
        Ok(())
    }
}

fn buttons() -> Result<MujocoEnv<DistanceReward, Buttons>, EnvError> {
    let config = FetchConfig::new(Task::Reach, RewardKind::Sparse);
    Ok(FetchEnv::on_mujoco(config)?.with_task(Buttons)?.time_limited())
}

/// Goes to A until it is touched, and then to B.
fn act(observation: &FetchObservation) -> [f32; 4] {
    let is_touched = observation.achieved_goal()[3] == 1.0;
    let to_b = Vector3::from_column_slice(&observation.desired_goal()[..3])
        - Vector3::from(observation.grip_position());
    let to_a = Vector3::from_column_slice(&observation.observation()[10..]);
    let [x, y, z] = (10.0 * if is_touched { to_b } else { to_a }).map(|way| way as f32).into();
    [x, y, z, 0.0]
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut env = buttons()?;
    for seed in 0..5 {
        let mut observation = env.reset(Some(seed))?.observation;
        let mut steps = 0;
        loop {
            let step = env.step(&act(&observation))?;
            (observation, steps) = (step.observation, steps + 1);
            if step.info.is_success {
                break println!("B after {steps} steps");
            }
            assert!(!step.truncated, "not within the episode");
        }
    }
    Ok(())
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn Error>> {
    let report = fetch_env::check::check_goal_env(buttons, &Default::default());
    assert!(report.passed(), "{report}");
    main()
}
