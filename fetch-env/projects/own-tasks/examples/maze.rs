//! An environment of your own without MuJoCo: a point finds its way through a maze.
//! `cargo run --release --example maze` learns it and writes `maze.html`, which plays an episode
//! back.

use std::error::Error;
use std::num::NonZeroU32;
use std::ops::ControlFlow;

use baselines::learn::{Target, TrainSettings, Trainer};
use baselines::page::{PlaybackEnv, Scene, episode_page};
use fetch_env::goal_reward::goal_distance;
use fetch_env::vec_env::{BatchObservation, GoalRows};
use fetch_env::wrappers::Wrapped;
use fetch_env::{
    ActionSpace, BoxSpace, DictSpace, DistanceReward, DistanceThreshold, Env, EnvError, EnvExt,
    GoalEnv, GoalEnvExt, GoalObservation, GoalReward, Info, NpRandom, Reset, RewardKind,
    SnapshotEnv, Space, Step, TimeLimit,
};
use serde::{Deserialize, Serialize};

/// Cells of length 1, seen from above; `#` is a wall.
const MAP: [&str; 5] = [
    ".....", //
    "####.", //
    ".....", //
    ".####", //
    ".....", //
];
const LEN: usize = MAP.len();
/// The largest move along an axis in a step.
const MOVE: f64 = 0.4;
/// The number of steps of an episode.
pub const STEPS: NonZeroU32 = NonZeroU32::new(60).unwrap();
const PIXELS_OF_CELL: usize = 32;

/// Where the point is and where it should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Places {
    point: [f64; 2],
    goal: [f64; 2],
}

impl GoalObservation for Places {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.point
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.point
    }

    fn desired_goal(&self) -> &[f64] {
        &self.goal
    }
}

impl BatchObservation for Places {
    type Rows = GoalRows<f64>;
}

/// Everything that determines what comes next; without random numbers before the first reset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    point: [f64; 2],
    goal: [f64; 2],
    random: Option<NpRandom>,
}

/// The maze: an action moves the point along x and y, and walls stop it.
#[derive(Clone, Debug)]
pub struct Maze {
    action_space: BoxSpace<f32>,
    observation_space: Space,
    reward: DistanceReward,
    state: State,
}

/// Returns the maze, with episodes of 60 steps and a reward of -1 until the goal is within 0.3.
pub fn maze() -> Result<Wrapped<Maze, TimeLimit>, EnvError> {
    let place = || BoxSpace::uniform(vec![2], 0.0, LEN as f64).map(Space::BoxF64);
    let parts = ["observation", "achieved_goal", "desired_goal"];
    let [observation, achieved, desired] = parts.map(|part| place().map(|space| (part, space)));
    let threshold = DistanceThreshold::new(0.3).map_err(EnvError::other)?;
    let maze = Maze {
        action_space: BoxSpace::uniform(vec![2], -1.0, 1.0)?,
        observation_space: DictSpace::new([observation?, achieved?, desired?])?.into(),
        reward: DistanceReward::new(RewardKind::Sparse, threshold),
        state: State { point: [0.5; 2], goal: [0.5; 2], random: None },
    };
    maze.wrap(TimeLimit::new(STEPS))
}

fn is_free([x, y]: [f64; 2]) -> bool {
    let cell = |place: f64| if place < 0.0 { LEN } else { place as usize };
    MAP.get(cell(y)).and_then(|row| row.as_bytes().get(cell(x))) == Some(&b'.')
}

impl Maze {
    fn observe(&self) -> (Places, Info) {
        let State { point, goal, .. } = self.state;
        let info = Info::new(self.is_success(&point, &goal), goal_distance(&point, &goal));
        (Places { point, goal }, info)
    }
}

impl Env for Maze {
    type Observation = Places;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = ();

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        _options: &(),
    ) -> Result<Reset<Places, Info>, EnvError> {
        let mut random = match (seed, self.state.random.take()) {
            (Some(seed), _) => NpRandom::new(seed),
            (None, Some(random)) => random,
            (None, None) => NpRandom::from_entropy()?,
        };
        let mut draw = || loop {
            let place = [0, 1].map(|_| random.uniform(0.0, LEN as f64));
            if is_free(place) {
                return place;
            }
        };
        let (point, goal) = (draw(), draw());
        self.state = State { point, goal, random: Some(random) };
        let (observation, info) = self.observe();
        Ok(Reset { observation, info })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<Places, Info>, EnvError> {
        if self.state.random.is_none() {
            return Err(EnvError::ResetNeeded);
        }
        self.action_space.check_action(action)?;
        for (axis, action) in action.iter().enumerate() {
            let mut moved = self.state.point;
            moved[axis] += MOVE * f64::from(action.clamp(-1.0, 1.0));
            if is_free(moved) {
                self.state.point = moved;
            }
        }
        let (observation, info) = self.observe();
        let reward = self.reward.reward(&observation.point, &observation.goal);
        Ok(Step { observation, reward, terminated: false, truncated: false, info })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl GoalEnv for Maze {
    type GoalReward = DistanceReward;

    fn goal_reward(&self) -> &DistanceReward {
        &self.reward
    }
}

/// For checkpoints of a run.
impl SnapshotEnv for Maze {
    type Snapshot = State;

    fn snapshot(&self) -> State {
        self.state.clone()
    }

    fn restore(&mut self, snapshot: &State) -> Result<(), EnvError> {
        self.state = snapshot.clone();
        Ok(())
    }
}

/// For the page: walls grey, the goal green and the point red.
impl PlaybackEnv for Maze {
    fn scene(&self) -> Scene<'_> {
        let side = LEN * PIXELS_OF_CELL;
        let color = |pixel: usize| {
            let place = [pixel % side, pixel / side]
                .map(|coordinate| (coordinate as f64 + 0.5) / PIXELS_OF_CELL as f64);
            match place {
                place if goal_distance(&place, &self.state.point) < 0.15 => [200, 40, 40],
                place if goal_distance(&place, &self.state.goal) < 0.3 => [60, 160, 80],
                place if is_free(place) => [245; 3],
                _ => [110; 3],
            }
        };
        let rgb = (0..side * side).flat_map(color).collect();
        Scene::Picture { rgb, width: side, height: side }
    }

    fn title(&self) -> String {
        "Maze".into()
    }
}

/// Learns the maze until two evaluations in a row succeed in 95 of 100 episodes.
pub fn learn(seed: u64) -> Result<Trainer<Wrapped<Maze, TimeLimit>>, Box<dyn Error>> {
    let mut trainer = Trainer::new(maze, TrainSettings::default(), seed, 2)?;
    let target = Target { success_rate: 0.95, evaluations: 2 };
    trainer.run(100_000, Some(target), |_, row| {
        println!("{} steps: {:.2}", row.counters.steps, row.success_rate.value);
        ControlFlow::Continue(())
    })?;
    Ok(trainer)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut policy = learn(0)?.policy("Maze")?;
    std::fs::write("maze.html", episode_page(&mut maze()?, &mut policy, 0)?)?;
    Ok(())
}
