//! The contact filter changes no bit, whatever a policy does.
//!
//! It runs a few episodes of every task and kind; `FETCH_FILTER_EPISODES=100` runs more, and
//! `FETCH_FILTER_MODEL=reference` uses the reference's model.
#![cfg(feature = "mujoco")]

use std::env;

use baselines::{Action, Policy, RandomPolicy, ScriptedPolicy};
use fetch_env::{BoxSpace, Env, FetchConfig, FetchObservation, ModelSource, Task, make};
use goal_reward::RewardKind;

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Drives the gripper straight at the object, or at the edge of the table if there is none, and
/// keeps pushing.
struct Chase;

impl Policy for Chase {
    fn act(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        let gripper = observation.grip_position();
        let target = observation.object_position().unwrap_or([1.1, 0.75, 0.38]);
        let [x, y, z] =
            [0, 1, 2].map(|i| (20.0 * (target[i] - gripper[i])).clamp(-1.0, 1.0) as f32);
        action.copy_from_slice(&[x, y, z, if x > 0.0 { 1.0 } else { -1.0 }]);
    }
}

/// Takes the largest actions, in a direction that it keeps for a while: to the limits of the arm.
struct Wild {
    random: RandomPolicy,
    action: Action,
    steps: u32,
}

impl Policy for Wild {
    fn act(&mut self, observation: &FetchObservation, action: &mut [f32]) {
        if self.steps.is_multiple_of(12) {
            self.random.act(observation, &mut self.action);
            self.action = self.action.map(f32::signum);
        }
        self.steps += 1;
        action.copy_from_slice(&self.action);
    }
}

fn policies(task: Task, space: &BoxSpace<f32>) -> [(&'static str, Box<dyn Policy>); 4] {
    let wild = Wild { random: RandomPolicy::new(space, 2), action: [0.0; 4], steps: 0 };
    [
        ("random", Box::new(RandomPolicy::new(space, 1))),
        ("scripted", Box::new(ScriptedPolicy::new(task))),
        ("chase", Box::new(Chase)),
        ("wild", Box::new(wild)),
    ]
}

fn model() -> ModelSource {
    match env::var("FETCH_FILTER_MODEL").as_deref() {
        Ok("reference") => ModelSource::Reference,
        _ => ModelSource::Builtin,
    }
}

fn episodes() -> Result<u64> {
    Ok(env::var("FETCH_FILTER_EPISODES").map_or(Ok(2), |number| number.parse())?)
}

#[test]
fn steps_are_the_same_with_and_without_it() -> Result {
    for task in Task::ALL {
        let config = FetchConfig::new(task, RewardKind::Sparse).with_model(model());
        let make = |filter| make(config.clone().with_contact_filter(filter));
        let (mut filtered, mut plain) = (make(true)?, make(false)?);
        let space = filtered.action_space().clone();
        for (kind, mut policy) in policies(task, &space) {
            for episode in 0..episodes()? {
                let place = format!("{task}, {kind}, episode {episode}");
                let reset = filtered.reset(Some(episode))?;
                assert_eq!(reset, plain.reset(Some(episode))?, "{place}");
                let (mut observation, mut action) = (reset.observation, [0.0; 4]);
                policy.reset();
                loop {
                    policy.act(&observation, &mut action);
                    let step = filtered.step(&action)?;
                    assert_eq!(step, plain.step(&action)?, "{place}");
                    let [ours, theirs] = [&filtered, &plain].map(|env| env.inner().simulator());
                    let (ours, theirs) = (ours.data(), theirs.data());
                    assert_eq!(ours.qpos(), theirs.qpos(), "{place}");
                    assert_eq!(ours.qvel(), theirs.qvel(), "{place}");
                    assert!(ours.contacts().eq(theirs.contacts()), "{place}");
                    if step.terminated || step.truncated {
                        break;
                    }
                    observation = step.observation;
                }
            }
        }
        let counts =
            filtered.inner().simulator().data().contact_filter().ok_or("no filter")?.counts();
        assert!(counts.rejected > counts.pairs / 4, "{task}: {counts:?}");
    }
    Ok(())
}
