//! Calls on one environment.

use arbitrary::Arbitrary;
use fetch_env::{Env, EnvError, FetchObservation, GoalEnvExt, GoalObservation, SnapshotEnv};

use crate::{Options, TestEnv};

#[derive(Arbitrary, Debug)]
pub enum Call {
    Reset(Option<u64>),
    ResetWith(Option<u64>, Options),
    Step(Vec<f32>),
    StepDown,
    StepUp,
    Snapshot,
    Restore(u8),
}

/// What the calls so far have led to.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// Before a reset, or after a failure.
    ResetNeeded,
    Running {
        steps: u32,
    },
    Over,
}

pub fn run(mut env: TestEnv, calls: &[Call]) {
    let limit = env.max_episode_steps().get();
    let mut state = State::ResetNeeded;
    let mut saved = Vec::new();
    for call in calls {
        let before = env.snapshot();
        match call {
            Call::Reset(seed) => {
                let reset = env.reset(*seed).expect("a reset");
                check(&reset.observation);
                state = State::Running { steps: 0 };
            }
            Call::ResetWith(seed, options) => match env.reset_with(*seed, &options.get()) {
                Ok(reset) => {
                    check(&reset.observation);
                    state = State::Running { steps: 0 };
                }
                Err(EnvError::OptionOutside { .. } | EnvError::Other(_)) => {
                    assert_eq!(env.snapshot(), before);
                }
                Err(error) => panic!("{error}"),
            },
            Call::Step(action) => state = step(&mut env, action, state, limit),
            Call::StepDown => state = step(&mut env, &[0.0, 0.0, -1.0, 0.0], state, limit),
            Call::StepUp => state = step(&mut env, &[0.0, 0.0, 1.0, 0.0], state, limit),
            Call::Snapshot => saved.push((before, state)),
            Call::Restore(at) => {
                let at = usize::from(*at) % saved.len().max(1);
                if let Some((snapshot, then)) = saved.get(at) {
                    env.restore(snapshot).expect("its own snapshot");
                    assert_eq!(env.snapshot(), *snapshot);
                    state = *then;
                }
            }
        }
    }
    check(&env.reset(None).expect("a reset").observation);
}

/// Takes a step, and returns the state to which it leads.
fn step(env: &mut TestEnv, action: &[f32], state: State, limit: u32) -> State {
    let before = env.snapshot();
    match env.step(action) {
        Ok(step) => {
            let State::Running { steps } = state else { panic!("a step without an episode") };
            check(&step.observation);
            let goals = (step.observation.achieved_goal(), step.observation.desired_goal());
            assert_eq!(Ok(step.reward), env.compute_reward(goals.0, goals.1));
            assert_eq!(step.truncated, steps + 1 == limit);
            if step.is_last() { State::Over } else { State::Running { steps: steps + 1 } }
        }
        // The failure of the simulation.
        Err(EnvError::Other(_)) => {
            assert!(matches!(state, State::Running { .. }) && action[2] < 0.0);
            State::ResetNeeded
        }
        Err(error) => {
            match error {
                EnvError::ResetNeeded => assert_eq!(state, State::ResetNeeded),
                EnvError::EpisodeOver => assert_eq!(state, State::Over),
                EnvError::ActionLength { actual, .. } => {
                    assert!(actual == action.len() && actual != 4)
                }
                EnvError::ActionNotFinite { index, .. } => assert!(!action[index].is_finite()),
                error => panic!("{error}"),
            }
            assert_eq!(env.snapshot(), before);
            state
        }
    }
}

pub fn check(observation: &FetchObservation) {
    let numbers =
        [observation.observation(), observation.achieved_goal(), observation.desired_goal()];
    assert!(numbers.concat().iter().all(|number| number.is_finite()));
}
