//! The time limit around a foreign environment that checks nothing itself.

use std::num::NonZeroU32;

use fetch_env::vec_env::GoalRows;
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    BatchObservation, BoxSpace, Env, EnvError, EnvExt, FetchEnv, GoalEnv, GoalEnvExt,
    GoalObservation, Info, Reset, SnapshotEnv, Space, Step, TimeLimit,
};
use fetch_sim::KinematicSimulator;
use goal_reward::{DistanceReward, GoalReward, goal_distance};
use proptest::prelude::*;

/// An environment that terminates at step `end` and truncates at step `cut`.
#[derive(Debug)]
struct Counter {
    steps: u32,
    end: u32,
    cut: u32,
    reward: ReachedIsTheEnd,
    action_space: BoxSpace<f32>,
    observation_space: Space,
}

/// A reward that ends the task at the goal, unlike Fetch's.
#[derive(Debug)]
struct ReachedIsTheEnd(DistanceReward);

impl GoalReward for ReachedIsTheEnd {
    fn reward(&self, achieved: &[f64], desired: &[f64]) -> f64 {
        self.0.reward(achieved, desired)
    }

    fn is_success(&self, achieved: &[f64], desired: &[f64]) -> bool {
        self.0.is_success(achieved, desired)
    }

    fn terminated(&self, achieved: &[f64], desired: &[f64]) -> bool {
        self.is_success(achieved, desired)
    }
}

/// The number of steps taken, and the step of the end.
#[derive(Clone, Debug, PartialEq)]
struct Count([f64; 2]);

impl BatchObservation for Count {
    type Rows = GoalRows<f64>;
}

impl GoalObservation for Count {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.0
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.0[..1]
    }

    fn desired_goal(&self) -> &[f64] {
        &self.0[1..]
    }
}

impl Counter {
    fn new(end: u32, cut: u32) -> Self {
        Self {
            steps: 0,
            end,
            cut,
            reward: ReachedIsTheEnd(DistanceReward::sparse()),
            action_space: BoxSpace::unbounded(1).expect("small"),
            observation_space: BoxSpace::<f64>::unbounded(2).expect("small").into(),
        }
    }

    fn observe(&self) -> (Count, Info) {
        let count = Count([self.steps, self.end].map(f64::from));
        let (achieved, desired) = (count.achieved_goal(), count.desired_goal());
        let info = Info::new(self.is_success(achieved, desired), goal_distance(achieved, desired));
        (count, info)
    }
}

impl Env for Counter {
    type Observation = Count;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(&mut self, _seed: Option<u64>, (): &()) -> Result<Reset<Count, Info>, EnvError> {
        self.steps = 0;
        let (observation, info) = self.observe();
        Ok(Reset { observation, info })
    }

    fn step(&mut self, _action: &[f32]) -> Result<Step<Count, Info>, EnvError> {
        self.steps += 1;
        let (observation, info) = self.observe();
        Ok(Step {
            reward: 0.0,
            terminated: info.is_success,
            truncated: self.steps == self.cut,
            observation,
            info,
        })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl GoalEnv for Counter {
    type GoalReward = ReachedIsTheEnd;

    fn goal_reward(&self) -> &ReachedIsTheEnd {
        &self.reward
    }
}

proptest! {
    #[test]
    fn an_episode_ends_at_the_first_of_its_ends_and_each_is_reported(
        end in 1..8_u32,
        cut in 1..8_u32,
        limit in 1..8_u32,
    ) {
        let max_episode_steps = NonZeroU32::new(limit).expect("at least 1");
        let mut env = Counter::new(end, cut).wrap(TimeLimit::new(max_episode_steps))?;
        prop_assert_eq!(env.step(&[0.0]), Err(EnvError::ResetNeeded));
        for _ in 0..2 {
            env.reset(None)?;
            let last = end.min(cut).min(limit);
            for elapsed in 1..=last {
                let step = env.step(&[0.0])?;
                prop_assert_eq!(step.terminated, elapsed == end);
                prop_assert_eq!(step.truncated, elapsed == cut || elapsed == limit);
                prop_assert_eq!(step.is_last(), elapsed == last);
                prop_assert_eq!(env.elapsed_steps(), elapsed);
            }
            prop_assert_eq!(env.step(&[0.0]), Err(EnvError::EpisodeOver));
            prop_assert_eq!(env.inner().steps, last, "a refused step reached the environment");
        }
    }
}

#[test]
fn the_goals_are_those_of_the_inner_environment() -> Result<(), EnvError> {
    let env = Counter::new(3, 9).wrap(TimeLimit::new(NonZeroU32::MIN))?;
    assert!(env.compute_terminated(&[3.0], &[3.0]));
    assert!(!env.compute_terminated(&[2.0], &[3.0]));
    assert!(!env.compute_truncated(&[3.0], &[3.0]));
    assert_eq!(env.compute_reward(&[2.0], &[3.0]), Ok(-1.0));
    Ok(())
}

#[test]
fn an_episode_is_not_restored_at_or_beyond_the_limit() -> Result<(), EnvError> {
    let limited = |steps: u32| -> Result<_, EnvError> {
        let env = fetch_env::make_kinematic("FetchReach-v4")?.into_inner();
        let limit = NonZeroU32::new(steps).expect("not zero");
        let env = env.wrap(TimeLimit::new(limit))?;
        assert_eq!(env.max_episode_steps(), limit);
        Ok(env)
    };
    let mut long = limited(9)?;
    long.reset(Some(0))?;
    for elapsed in 1..=9 {
        long.step(&[0.1; 4])?;
        let fits = limited(5)?.restore(&long.snapshot());
        assert_eq!(fits.is_ok(), elapsed < 5, "{elapsed}: {fits:?}");
        assert_eq!(limited(9)?.restore(&long.snapshot()), Ok(()));
    }
    // An episode that is over has the limit's length.
    assert_eq!(long.elapsed_steps(), 9);
    Ok(())
}

#[test]
fn environments_can_be_handed_to_other_threads() {
    fn is_send<T: Send>() {}
    is_send::<Wrapped<FetchEnv<KinematicSimulator>, TimeLimit>>();
    is_send::<<Wrapped<FetchEnv<KinematicSimulator>, TimeLimit> as SnapshotEnv>::Snapshot>();
    is_send::<EnvError>();
    #[cfg(feature = "mujoco")]
    is_send::<fetch_env::MujocoEnv>();
}
