//! The contact filter changes no bit, whatever a policy does.
//!
//! A few episodes of every task and kind by default; `FETCH_FILTER_EPISODES=100` asks for more, and
//! `FETCH_FILTER_MODEL=reference` for the reference's model.
#![cfg(feature = "mujoco")]

use std::env;

use baselines::{Action, Policy, RandomPolicy, ScriptedPolicy};
use fetch_env::{Env, FetchConfig, FetchObservation, ModelSource, Task, make_with_config};
use goal_reward::RewardKind;

/// Drives the gripper straight at the object, or at the edge of the table where there is none, and
/// presses on.
struct Chase;

impl Policy for Chase {
    fn act(&mut self, observation: &FetchObservation) -> Action {
        let gripper = observation.grip_position();
        let target = observation.object_position().unwrap_or([1.1, 0.75, 0.38]);
        let [x, y, z] =
            [0, 1, 2].map(|i| (20.0 * (target[i] - gripper[i])).clamp(-1.0, 1.0) as f32);
        [x, y, z, if x > 0.0 { 1.0 } else { -1.0 }]
    }
}

/// As far as actions go, in a direction that is kept for a while: to the limits of the arm.
struct Wild {
    random: RandomPolicy,
    action: Action,
    steps: u32,
}

impl Policy for Wild {
    fn act(&mut self, observation: &FetchObservation) -> Action {
        if self.steps.is_multiple_of(12) {
            self.action = self.random.act(observation).map(f32::signum);
        }
        self.steps += 1;
        self.action
    }
}

fn policies(task: Task) -> [(&'static str, Box<dyn Policy>); 4] {
    let wild = Wild { random: RandomPolicy::new(2), action: [0.0; 4], steps: 0 };
    [
        ("random", Box::new(RandomPolicy::new(1))),
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

fn episodes() -> u64 {
    env::var("FETCH_FILTER_EPISODES").map_or(2, |number| number.parse().expect("a number"))
}

#[test]
fn steps_are_the_same_with_and_without_it() {
    for task in Task::ALL {
        let config = FetchConfig::new(task, RewardKind::Sparse).with_model(model());
        let make =
            |filter| make_with_config(config.clone().with_contact_filter(filter)).expect("MuJoCo");
        let (mut filtered, mut plain) = (make(true), make(false));
        for (kind, mut policy) in policies(task) {
            for episode in 0..episodes() {
                let place = format!("{task}, {kind}, episode {episode}");
                let reset = filtered.reset(Some(episode)).expect("a reset");
                assert_eq!(reset, plain.reset(Some(episode)).expect("a reset"), "{place}");
                let mut observation = reset.observation;
                policy.reset();
                loop {
                    let action = policy.act(&observation);
                    let step = filtered.step(&action).expect("a step");
                    assert_eq!(step, plain.step(&action).expect("a step"), "{place}");
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
        let counts = filtered.inner().simulator().data().contact_filter().expect("on").counts();
        assert!(counts.rejected > counts.pairs / 4, "{task}: {counts:?}");
    }
}
