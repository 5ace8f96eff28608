use fetch_sim::{Control, Settled, Simulator};
use goal_reward::{DistanceReward, GoalReward, goal_distance};
use nalgebra::Vector3;

use crate::{
    BoxSpace, DictSpace, Env, EnvError, FetchConfig, FetchObservation, FetchResetOptions,
    FetchSnapshot, GoalEnv, GoalObservation, Info, NpRandom, Reset, SnapshotEnv, Space, Step,
    TimeLimit, fetch::reset::Start,
};

/// The gripper's largest displacement along an axis in one step, in meters.
const MAX_DISPLACEMENT: f32 = 0.05;

/// A Fetch environment: a configuration, a simulator and a reward.
///
/// Actions are `[dx, dy, dz, fingers]`, each clipped to [-1, 1] in single precision: the first
/// three displace the gripper's target by up to 5 cm along the world's axes, the last opens
/// (positive) or closes the fingers and has no effect where the task holds them closed. Observations
/// are [`FetchObservation`]s.
///
/// Episodes have no end of their own; [`TimeLimit`] gives them one.
#[derive(Clone, Debug)]
pub struct FetchEnv<S> {
    config: FetchConfig,
    simulator: S,
    reward: DistanceReward,
    settled: Settled,
    action_space: BoxSpace<f32>,
    observation_space: Space,
    /// `None` until the first reset.
    random: Option<NpRandom>,
    /// `None` where a reset is needed.
    goal: Option<[f64; 3]>,
}

impl<S: Simulator> FetchEnv<S> {
    /// An environment in `simulator`, which must have been made from
    /// [`config.sim()`](FetchConfig::sim).
    ///
    /// # Errors
    /// [`EnvError::SimulatorMismatch`] if it was not.
    pub fn new(config: FetchConfig, simulator: S) -> Result<Self, EnvError> {
        let settled = simulator.settled();
        let mismatch = |reason| Err(EnvError::SimulatorMismatch { reason });
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
        let goal = || BoxSpace::<f64>::unbounded(3).into();
        let observation = BoxSpace::<f64>::unbounded(FetchObservation::len_of(task)).into();
        let observation_space = DictSpace::new([
            ("achieved_goal", goal()),
            ("desired_goal", goal()),
            ("observation", observation),
        ])
        .expect("the keys differ");
        Ok(Self {
            reward: config.reward(),
            config,
            simulator,
            settled,
            action_space: BoxSpace::uniform(vec![4], -1.0, 1.0).expect("-1 is less than 1"),
            observation_space: observation_space.into(),
            random: None,
            goal: None,
        })
    }

    /// Ends every episode after [`max_episode_steps`](FetchConfig::max_episode_steps).
    #[must_use]
    pub fn time_limited(self) -> TimeLimit<Self> {
        let max_episode_steps = self.config.max_episode_steps();
        TimeLimit::new(self, max_episode_steps)
    }

    /// What the environment was made from.
    #[must_use]
    pub const fn config(&self) -> &FetchConfig {
        &self.config
    }

    /// The simulator below. It is not to be had mutably: its state is the environment's.
    #[must_use]
    pub const fn simulator(&self) -> &S {
        &self.simulator
    }

    /// Where the goal is, in meters; `None` where a reset is needed.
    #[must_use]
    pub const fn desired_goal(&self) -> Option<[f64; 3]> {
        self.goal
    }

    /// The seed of the random numbers, given or taken from the operating system; `None` before the
    /// first reset.
    #[must_use]
    pub fn np_random_seed(&self) -> Option<u64> {
        self.random.as_ref().map(NpRandom::seed)
    }

    /// The present observation, as the last reset or step gave it, or as it was when a restored
    /// snapshot was taken.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] if there is none.
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
        Info {
            is_success: self.is_success(achieved, desired),
            distance: goal_distance(achieved, desired),
        }
    }

    /// The command that an action stands for.
    fn control(&self, action: &[f32]) -> Result<Control, EnvError> {
        let &[dx, dy, dz, fingers] = action else {
            let (expected, actual) = (self.action_space.len(), action.len());
            return Err(EnvError::ActionLength { expected, actual });
        };
        if let Some(index) = action.iter().position(|element| !element.is_finite()) {
            return Err(EnvError::ActionNotFinite { index, value: action[index] });
        }
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
        self.simulator.reset(options.object_position.or(start.object_position))?;
        self.goal = Some(options.desired_goal.unwrap_or(start.desired_goal));
        let observation = self.observe()?;
        Ok(Reset { observation, info: self.info(&observation) })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<FetchObservation, Info>, EnvError> {
        let goal = self.goal.ok_or(EnvError::ResetNeeded)?;
        let control = self.control(action)?;
        // Without a goal until the simulation has succeeded, so that a failure asks for a reset.
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
        snapshot.check(self.config.sim())?;
        self.simulator.restore(&snapshot.simulator)?;
        self.random.clone_from(&snapshot.random);
        self.goal = snapshot.goal;
        Ok(())
    }
}
