//! Laws of episodes: observations, starts and the time limit.

use std::collections::HashMap;

use fetch_env::{
    Env, EnvError, EnvId, FetchObservation, FetchResetOptions, GoalObservation, ObservationField,
};
use fetch_sim::{Simulator, Task};
use nalgebra::{Rotation3, Vector3};
use serde::Deserialize;

use super::{Backend, Result, make, random_steps};

/// Returns the elements of a field, by the public table.
fn field(task: Task, observation: &FetchObservation, name: &str) -> Vec<f64> {
    let field = ObservationField::find(task, name).expect("a field of the task");
    observation.observation()[field.range.clone()].to_vec()
}

pub(crate) fn observations_are_made_as_documented<B: Backend>() -> Result {
    const PERIOD: f64 = 0.04;
    let scaled = |velocity: &[f64]| velocity.iter().map(|v| v * PERIOD).collect::<Vec<_>>();
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        env.reset(Some(3))?;
        for step in 0..20 {
            let observation = random_steps::<B>(&mut env, step, 1)?.remove(0).observation;
            let get = |name| field(id.task, &observation, name);
            let simulator = env.inner().simulator();
            assert_eq!(simulator.control_period(), PERIOD, "{id}");

            let gripper = simulator.gripper();
            assert_eq!(get("grip_pos"), gripper.position.as_slice(), "{id}");
            assert_eq!(get("gripper_state"), gripper.finger_positions, "{id}");
            assert_eq!(get("grip_velp"), scaled(gripper.velocity.as_slice()), "{id}");
            assert_eq!(get("gripper_vel"), scaled(&gripper.finger_velocities), "{id}");
            assert_eq!(observation.grip_position(), gripper.position.as_slice(), "{id}");
            assert_eq!(observation.grip_velocity(), *get("grip_velp"), "{id}");
            assert_eq!(observation.finger_positions(), gripper.finger_positions, "{id}");

            let Some(object) = simulator.object() else {
                assert_eq!(id.task, Task::Reach);
                assert_eq!(observation.observation().len(), 10);
                assert_eq!(observation.achieved_goal(), get("grip_pos"), "{id}");
                assert_eq!(observation.object_position(), None);
                assert_eq!(observation.object_relative_velocity(), None);
                continue;
            };
            assert_eq!(observation.observation().len(), 25, "{id}");
            assert_eq!(observation.achieved_goal(), get("object_pos"), "{id}");
            assert_eq!(get("object_pos"), object.position.as_slice(), "{id}");
            assert_eq!(observation.object_position(), Some(object.position.into()), "{id}");
            let relative = object.position - gripper.position;
            assert_eq!(get("object_rel_pos"), relative.as_slice(), "{id}");
            let velocity = object.linear_velocity * PERIOD - gripper.velocity * PERIOD;
            assert_eq!(get("object_velp"), velocity.as_slice(), "{id}");
            assert_eq!(observation.object_relative_velocity(), Some(velocity.into()), "{id}");
            assert_eq!(get("object_velr"), scaled(object.angular_velocity.as_slice()), "{id}");
            let [x, y, z] = get("object_rot").try_into().expect("three angles");
            let turn = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
            let rotation = turn(Vector3::x_axis(), x)
                * turn(Vector3::y_axis(), y)
                * turn(Vector3::z_axis(), z);
            assert!((rotation.matrix() - object.rotation).abs().max() < 1e-9, "{id}");
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct Recording {
    tasks: HashMap<Task, RecordedTask>,
}

#[derive(Deserialize)]
struct RecordedTask {
    initial_gripper_xpos: [f64; 3],
    starts: Vec<RecordedStarts>,
}

#[derive(Deserialize)]
struct RecordedStarts {
    seed: u64,
    episodes: Vec<RecordedStart>,
}

#[derive(Deserialize)]
struct RecordedStart {
    object_position: Option<[f64; 2]>,
    desired_goal: [f64; 3],
}

pub(crate) fn goals_and_objects_start_where_the_reference_puts_them<B: Backend>() -> Result {
    // Relative to the settled gripper, whose position differs between versions of MuJoCo.
    const TOLERANCE: f64 = 1e-12;
    let recording = include_str!("../../fixtures/episode_starts.json");
    let recording: Recording = serde_json::from_str(recording)?;
    for id in EnvId::ALL {
        let recorded = &recording.tasks[&id.task];
        let mut env = make::<B>(id)?;
        let settled = env.inner().simulator().settled();
        let shift = |position: f64, axis: usize| {
            position - recorded.initial_gripper_xpos[axis] + settled.gripper_position[axis]
        };
        for RecordedStarts { seed, episodes } in &recorded.starts {
            for (episode, start) in episodes.iter().enumerate() {
                let reset = env.reset((episode == 0).then_some(*seed))?;
                let observation = reset.observation;
                let pairs = |actual: &[f64], recorded: &[f64]| {
                    for axis in 0..2 {
                        let error = actual[axis] - shift(recorded[axis], axis);
                        assert!(error.abs() < TOLERANCE, "{id}, seed {seed}: off by {error}");
                    }
                };
                pairs(observation.desired_goal(), &start.desired_goal);
                if let (Some(actual), Some(recorded)) =
                    (observation.object_position(), start.object_position)
                {
                    pairs(&actual, &recorded);
                }
                let height = observation.desired_goal()[2];
                match settled.object_height {
                    None => {
                        assert!((height - shift(start.desired_goal[2], 2)).abs() < TOLERANCE);
                    }
                    Some(rest) if id.task == Task::PickAndPlace => {
                        assert!((0.0..0.45).contains(&(height - rest)), "{id}, seed {seed}");
                    }
                    Some(rest) => assert_eq!(height, rest, "{id}, seed {seed}"),
                }
            }
        }
    }
    Ok(())
}

pub(crate) fn an_episode_lasts_fifty_steps_and_is_never_terminated<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        // Reaching the goal at the start must not end the episode.
        let start = env.reset(Some(0))?.observation;
        let options = FetchResetOptions::default().with_desired_goal(start.achieved_goal());
        let start = env.reset_with(Some(0), &options)?;
        assert!(start.info.is_success, "{id}: {start:?}");
        for elapsed in 1..=50 {
            let step = env.step(&[0.0; 4])?;
            assert!(!step.terminated, "{id}");
            assert_eq!(step.truncated, elapsed == 50, "{id}: step {elapsed}");
            assert_eq!(env.elapsed_steps(), elapsed);
        }
        assert_eq!(env.step(&[0.0; 4]), Err(EnvError::EpisodeOver), "{id}");

        // Without the limit the episode never ends.
        let mut env = env.into_inner();
        env.reset(Some(0))?;
        for _ in 0..60 {
            assert!(!env.step(&[0.0; 4])?.is_last(), "{id}");
        }
    }
    Ok(())
}
