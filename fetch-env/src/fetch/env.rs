//! The Fetch environment: settings, a simulator and a reward.

use fetch_sim::{Control, LARGEST_NUMBER, Settled, SimConfig, Simulator, Substeps};
use goal_reward::{DistanceReward, GoalReward, goal_distance};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::config::FetchConfig;
use super::error::MakeError;
use super::observation::FetchObservation;
use super::reset::{FetchResetOptions, Start};
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::goal::{GoalEnv, GoalEnvExt, Info};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{Env, Reset, SnapshotEnv, Step};
use crate::gym::spaces::{DictSpace, Space, box_space::BoxSpace};
use crate::gym::{
    error::EnvError,
    np_random::NpRandom,
    wrappers::{TimeLimit, Wrapped},
};

/// Largest displacement of the gripper along an axis in one step, in meters.
const MAX_DISPLACEMENT: f32 = 0.05;

/// A Fetch environment: settings, a simulator and a reward.
///
/// Actions are `[dx, dy, dz, fingers]`, each clipped to [-1, 1] in single precision. The first
/// three displace the gripper's target by up to 5 cm along the world's axes. The last opens
/// (positive) or closes the fingers; it has no effect in tasks that hold them closed. Observations
/// are [`FetchObservation`]s.
///
/// Episodes never end by themselves; [`TimeLimit`] ends them.
#[derive(Clone, Debug)]
pub struct FetchEnv<S> {
    config: FetchConfig,
    reward: DistanceReward,
    simulator: S,
    settled: Settled,
    action_space: BoxSpace<f32>,
    observation_space: Space,
    /// `None` until the first reset.
    random: Option<NpRandom>,
    /// `None` until a reset.
    goal: Option<[f64; 3]>,
}

impl<S: Simulator> FetchEnv<S> {
    /// Creates an environment in `simulator`, which must be made from
    /// [`config.sim()`](FetchConfig::sim).
    ///
    /// # Errors
    /// [`MakeError::SimulatorMismatch`] if the simulator is made from other settings.
    pub fn new(config: FetchConfig, simulator: S) -> Result<Self, MakeError> {
        let settled = simulator.settled();
        let mismatch = |reason| Err(MakeError::SimulatorMismatch { reason });
        let (task, theirs) = (config.task(), simulator.task());
        if theirs != task {
            return mismatch(format!("it simulates {theirs}, the task is {task}"));
        }
        let (period, theirs) = (config.control_period(), simulator.control_period());
        if theirs != period {
            return mismatch(format!("its steps last {theirs} s, they should last {period} s"));
        }
        if settled.object_height.is_some() != task.has_object() {
            return mismatch(format!("the object's settled height is {:?}", settled.object_height));
        }
        let vector = |len| BoxSpace::<f64>::unbounded(len).map(Space::from);
        let observation_space = DictSpace::new([
            ("achieved_goal", vector(3)?),
            ("desired_goal", vector(3)?),
            ("observation", vector(FetchObservation::len_of(task))?),
        ])?;
        Ok(Self {
            reward: config.distance_reward(),
            config,
            simulator,
            settled,
            action_space: BoxSpace::uniform(vec![4], -1.0, 1.0)?,
            observation_space: observation_space.into(),
            random: None,
            goal: None,
        })
    }

    /// Truncates every episode after [`max_episode_steps`](FetchConfig::max_episode_steps).
    #[must_use]
    pub const fn time_limited(self) -> Wrapped<Self, TimeLimit> {
        let limit = TimeLimit::new(self.config.max_episode_steps());
        Wrapped::attached(self, limit)
    }

    /// Returns the settings of the environment.
    pub const fn config(&self) -> &FetchConfig {
        &self.config
    }

    /// Returns the simulator. There is no mutable access, because the environment owns the
    /// simulator's state.
    #[must_use]
    pub const fn simulator(&self) -> &S {
        &self.simulator
    }

    /// Returns the goal of the episode, in meters; `None` until a reset.
    #[must_use]
    pub const fn desired_goal(&self) -> Option<[f64; 3]> {
        self.goal
    }

    /// Returns the seed of the random numbers, whether the caller or the operating system provided
    /// it; `None` before the first reset.
    #[must_use]
    pub fn np_random_seed(&self) -> Option<u64> {
        self.random.as_ref().map(NpRandom::initial_seed)
    }

    /// Returns the current observation, which the last reset or step returned, or which the
    /// restored environment had.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before a reset and after a failure.
    pub fn observe(&self) -> Result<FetchObservation, EnvError> {
        let goal = self.goal.ok_or(EnvError::ResetNeeded)?;
        Ok(FetchObservation::new(
            &self.simulator.gripper(),
            self.simulator.object().as_ref(),
            goal,
            self.simulator.control_period(),
        ))
    }

    fn info(&self, observation: &FetchObservation) -> Info {
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        Info::new(self.is_success(achieved, desired), goal_distance(achieved, desired))
    }

    /// Turns an action into the command of a control step.
    fn control(&self, action: &[f32]) -> Result<Control, EnvError> {
        self.action_space.check_action(action)?;
        let &[dx, dy, dz, fingers] = action else {
            let (expected, actual) = (self.action_space.len(), action.len());
            return Err(EnvError::ActionLength { expected, actual });
        };
        // Clipped and scaled in single precision, then widened, as the reference does.
        let displacement = |element: f32| f64::from(element.clamp(-1.0, 1.0) * MAX_DISPLACEMENT);
        Ok(Control {
            displacement: Vector3::new(displacement(dx), displacement(dy), displacement(dz)),
            fingers: f64::from(fingers.clamp(-1.0, 1.0)),
        })
    }
}

impl<S: Simulator> Env for FetchEnv<S> {
    type Observation = FetchObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = FetchResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> Result<Reset<FetchObservation, Info>, EnvError> {
        options.check(self.config.task())?;
        let mut random = match (seed, &self.random) {
            (Some(seed), _) => NpRandom::new(seed),
            (None, Some(random)) => random.clone(),
            (None, None) => NpRandom::from_entropy()?,
        };
        let start = Start::draw(&self.config, &self.settled, &mut random);
        self.random = Some(random);
        self.goal = None;
        self.simulator.reset(options.object_position().or(start.object_position))?;
        self.goal = Some(options.desired_goal().unwrap_or(start.desired_goal));
        let observation = self.observe()?;
        Ok(Reset { observation, info: self.info(&observation) })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<FetchObservation, Info>, EnvError> {
        let goal = self.goal.ok_or(EnvError::ResetNeeded)?;
        let control = self.control(action)?;
        // The goal is absent until the simulation succeeds, so that a failure demands a reset.
        self.goal = None;
        self.simulator.step(&control)?;
        self.goal = Some(goal);
        let observation = self.observe()?;
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        Ok(Step {
            reward: self.reward.reward(achieved, desired),
            terminated: self.compute_terminated(achieved, desired),
            truncated: self.compute_truncated(achieved, desired),
            info: self.info(&observation),
            observation,
        })
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl<S: Simulator> GoalEnv for FetchEnv<S> {
    type GoalReward = DistanceReward;

    fn goal_reward(&self) -> &DistanceReward {
        &self.reward
    }
}

impl<S: Simulator> SnapshotEnv for FetchEnv<S> {
    type Snapshot = FetchSnapshot<S::Snapshot>;

    fn snapshot(&self) -> Self::Snapshot {
        FetchSnapshot {
            sim: self.config.sim().clone(),
            simulator: self.simulator.snapshot(),
            random: self.random.clone(),
            goal: self.goal,
        }
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        let foreign = |reason| Err(EnvError::ForeignSnapshot { reason });
        let (theirs, ours) = (&snapshot.sim, self.config.sim());
        if theirs.task() != ours.task() {
            return foreign(format!("it is of {}, this is {}", theirs.task(), ours.task()));
        }
        let (theirs, ours) = (theirs.n_substeps(), ours.n_substeps());
        if theirs != ours {
            let [theirs, ours] = [theirs, ours].map(Substeps::get);
            return foreign(format!("it was taken with {theirs} substeps, these are {ours}"));
        }
        let is_valid = |number: &f64| number.abs() <= LARGEST_NUMBER;
        if snapshot.goal.is_some_and(|goal| !goal.iter().all(is_valid)) {
            return foreign(format!("its goal is {:?}", snapshot.goal));
        }
        if snapshot.goal.is_some() && snapshot.random.is_none() {
            return foreign("it has a goal but no random numbers".into());
        }
        self.simulator.restore(&snapshot.simulator)?;
        self.random.clone_from(&snapshot.random);
        self.goal = snapshot.goal;
        Ok(())
    }
}

/// Snapshot of a [`FetchEnv`]: the simulation, the goal and the random numbers.
///
/// `S` is the simulator's own snapshot. Formats that write every bit of a number preserve it
/// exactly; serde_json needs its feature `float_roundtrip`. A snapshot fits every environment whose
/// simulator is made the same way (task, model, number of substeps), whatever its rewards and
/// ranges.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FetchSnapshot<S> {
    sim: SimConfig,
    simulator: S,
    random: Option<NpRandom>,
    goal: Option<[f64; 3]>,
}

#[cfg(feature = "render")]
impl crate::pictures::render::RenderEnv for FetchEnv<fetch_sim::MujocoSimulator> {
    fn sim_config(&self) -> &SimConfig {
        self.config.sim()
    }

    fn update_scene(&self, renderer: &mut fetch_sim::Renderer) -> Result<(), EnvError> {
        let goal = self.goal.ok_or(EnvError::ResetNeeded)?;
        Ok(renderer.update_scene(&self.simulator, &[Vector3::from(goal)])?)
    }
}
