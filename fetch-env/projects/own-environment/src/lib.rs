//! A goal-conditioned environment: push a puck to a place on a table. The simulator, the
//! observation of single precision and the two-dimensional goal are this project's own.

mod simulator;

use fetch_env::{
    ActionSpace, BatchObservation, BoxSpace, DictSpace, DistanceReward, DistanceThreshold, Env,
    EnvError, GoalEnv, GoalEnvExt, GoalObservation, GoalReward, Info, NpRandom, Reset, RewardKind,
    SnapshotEnv, Space, Step, goal_reward::goal_distance, vec_env::GoalRows,
};
use serde::{Deserialize, Serialize};

use simulator::Puck;

/// What a policy sees: the puck's position and velocity, and the goals.
#[derive(Clone, Debug, PartialEq)]
pub struct PuckObservation {
    state: [f32; 4],
    achieved_goal: [f64; 2],
    desired_goal: [f64; 2],
}

impl GoalObservation for PuckObservation {
    type Element = f32;

    fn observation(&self) -> &[f32] {
        &self.state
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved_goal
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired_goal
    }
}

/// Many observations are the rows of three matrices.
impl BatchObservation for PuckObservation {
    type Rows = GoalRows<f32>;
}

/// The environment. It has no time limit of its own: wrap it in a [`fetch_env::TimeLimit`].
#[derive(Clone, Debug)]
pub struct PuckEnv {
    action_space: BoxSpace<f32>,
    observation_space: Space,
    reward: DistanceReward,
    state: State,
}

/// Everything that determines what comes next.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    puck: Puck,
    desired_goal: [f64; 2],
    /// `None` until the first reset.
    random: Option<NpRandom>,
}

impl PuckEnv {
    /// Creates the environment with a sparse reward; the puck reaches the goal within 10 cm.
    pub fn new() -> Result<Self, EnvError> {
        let goal = || BoxSpace::uniform(vec![2], -1.0, 1.0).map(Space::BoxF64);
        let observation_space = DictSpace::new([
            ("observation", Space::BoxF32(BoxSpace::uniform(vec![4], -1.0, 1.0)?)),
            ("achieved_goal", goal()?),
            ("desired_goal", goal()?),
        ])?;
        let threshold = DistanceThreshold::new(0.1).map_err(EnvError::other)?;
        Ok(Self {
            action_space: BoxSpace::uniform(vec![2], -1.0, 1.0)?,
            observation_space: observation_space.into(),
            reward: DistanceReward::new(RewardKind::Sparse, threshold),
            state: State { puck: Puck::default(), desired_goal: [0.0; 2], random: None },
        })
    }

    fn observe(&self) -> (PuckObservation, Info) {
        let Puck { position: [x, y], velocity: [vx, vy] } = self.state.puck;
        let observation = PuckObservation {
            state: [x, y, vx, vy],
            achieved_goal: [x.into(), y.into()],
            desired_goal: self.state.desired_goal,
        };
        let (achieved, desired) = (&observation.achieved_goal, &observation.desired_goal);
        let is_success = self.is_success(achieved, desired);
        let info = Info::new(is_success, goal_distance(achieved, desired));
        (observation, info)
    }
}

impl Env for PuckEnv {
    type Observation = PuckObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        _options: &(),
    ) -> Result<Reset<PuckObservation, Info>, EnvError> {
        let mut random = match (seed, self.state.random.take()) {
            (Some(seed), _) => NpRandom::new(seed),
            (None, Some(random)) => random,
            (None, None) => NpRandom::from_entropy()?,
        };
        let mut place = || [random.uniform(-0.8, 0.8), random.uniform(-0.8, 0.8)];
        let position = place().map(|coordinate| coordinate as f32);
        let desired_goal = place();
        self.state = State {
            puck: Puck { position, ..Puck::default() },
            desired_goal,
            random: Some(random),
        };
        let (observation, info) = self.observe();
        Ok(Reset { observation, info })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<PuckObservation, Info>, EnvError> {
        if self.state.random.is_none() {
            return Err(EnvError::ResetNeeded);
        }
        self.action_space.check_action(action)?;
        self.state.puck.push([action[0].clamp(-1.0, 1.0), action[1].clamp(-1.0, 1.0)]);
        let (observation, info) = self.observe();
        let (achieved, desired) = (&observation.achieved_goal, &observation.desired_goal);
        Ok(Step {
            reward: self.reward.reward(achieved, desired),
            terminated: self.compute_terminated(achieved, desired),
            truncated: self.compute_truncated(achieved, desired),
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

impl GoalEnv for PuckEnv {
    type GoalReward = DistanceReward;

    fn goal_reward(&self) -> &DistanceReward {
        &self.reward
    }
}

impl SnapshotEnv for PuckEnv {
    type Snapshot = State;

    fn snapshot(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, snapshot: &State) -> Result<(), EnvError> {
        self.state = snapshot.clone();
        Ok(())
    }
}
