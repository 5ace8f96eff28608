//! An environment without a simulator: a point on a plane, observed in single precision.

use std::num::NonZeroU32;

use fetch_env::wrappers::Wrapped;
use fetch_env::{
    BatchObservation, BoxSpace, DictSpace, DistanceReward, Env, EnvError, EnvExt, GoalEnv,
    GoalEnvExt, GoalObservation, GoalReward, Info, NpRandom, Reset, SnapshotEnv, Space, Step,
    TimeLimit, goal_reward::goal_distance, vec_env::GoalRows,
};

pub(crate) const STEPS: u32 = 20;

/// The point and its goal, in units of the plane.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Place {
    at: [f32; 2],
    achieved: [f64; 2],
    desired: [f64; 2],
}

impl GoalObservation for Place {
    type Element = f32;

    fn observation(&self) -> &[f32] {
        &self.at
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired
    }
}

impl BatchObservation for Place {
    type Rows = GoalRows<f32>;
}

#[derive(Clone, Debug)]
pub(crate) struct Plane {
    action_space: BoxSpace<f32>,
    observation_space: Space,
    reward: DistanceReward,
    pub(crate) at: [f32; 2],
    pub(crate) goal: [f64; 2],
    random: NpRandom,
}

impl Plane {
    pub(crate) fn make() -> Result<Wrapped<Self, TimeLimit>, EnvError> {
        Self::with_actions(BoxSpace::uniform(vec![2], -1.0, 1.0)?)
    }

    /// Returns a plane whose actions have no bounds.
    #[allow(dead_code, reason = "not every test plans")]
    pub(crate) fn unbounded() -> Result<Wrapped<Self, TimeLimit>, EnvError> {
        Self::with_actions(BoxSpace::unbounded(2)?)
    }

    fn with_actions(action_space: BoxSpace<f32>) -> Result<Wrapped<Self, TimeLimit>, EnvError> {
        let vector = || BoxSpace::<f64>::unbounded(2).map(Space::from);
        let observation_space = DictSpace::new([
            ("achieved_goal", vector()?),
            ("desired_goal", vector()?),
            ("observation", BoxSpace::<f32>::unbounded(2)?.into()),
        ])?;
        let plane = Self {
            action_space,
            observation_space: observation_space.into(),
            reward: DistanceReward::sparse(),
            at: [0.0; 2],
            goal: [0.0; 2],
            random: NpRandom::new(0),
        };
        plane.wrap(TimeLimit::new(NonZeroU32::new(STEPS).expect("not 0")))
    }

    fn observe(&self) -> (Place, Info) {
        let achieved = self.at.map(f64::from);
        let place = Place { at: self.at, achieved, desired: self.goal };
        let is_success = self.is_success(&achieved, &self.goal);
        (place, Info::new(is_success, goal_distance(&achieved, &self.goal)))
    }
}

impl Env for Plane {
    type Observation = Place;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        _options: &(),
    ) -> Result<Reset<Place, Info>, EnvError> {
        if let Some(seed) = seed {
            self.random = NpRandom::new(seed);
        }
        self.at = [0.0; 2];
        self.goal = [self.random.uniform(-0.5, 0.5), self.random.uniform(-0.5, 0.5)];
        let (observation, info) = self.observe();
        Ok(Reset { observation, info })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<Place, Info>, EnvError> {
        for (at, action) in self.at.iter_mut().zip(action) {
            *at += 0.1 * action.clamp(-1.0, 1.0);
        }
        let (observation, info) = self.observe();
        let reward = self.reward.reward(&observation.achieved, &observation.desired);
        Ok(Step { observation, reward, terminated: false, truncated: false, info })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl GoalEnv for Plane {
    type GoalReward = DistanceReward;

    fn goal_reward(&self) -> &DistanceReward {
        &self.reward
    }
}

impl SnapshotEnv for Plane {
    type Snapshot = ([f32; 2], [f64; 2], NpRandom);

    fn snapshot(&self) -> Self::Snapshot {
        (self.at, self.goal, self.random.clone())
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        (self.at, self.goal, self.random) = snapshot.clone();
        Ok(())
    }
}
