//! The Fetch environment: settings, a simulator and a reward.

use std::borrow::Cow;

use fetch_sim::{Simulator, Task};
use goal_reward::{DistanceReward, GoalReward, Symmetry, goal_distance};

use super::action::{ACTION_LEN, Precision, checked, control};
use super::config::FetchConfig;
use super::error::MakeError;
use super::interface::Interface;
use super::observation::{FetchObservation, Goal, Lengths, observation_space};
use super::reset::FetchResetOptions;
use super::task::FetchTask;
use super::variation::Varied;
use crate::gym::env::goal::{GoalEnv, GoalEnvExt, Info};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{Env, Reset, Step};
use crate::gym::spaces::{Space, box_space::BoxSpace};
use crate::gym::{
    error::EnvError,
    np_random::NpRandom,
    wrappers::{TimeLimit, Wrapped},
};

/// A Fetch environment: settings, a simulator, a reward and a task.
///
/// Actions are `[dx, dy, dz, fingers]`, each clipped to [-1, 1] in single precision. The first
/// three displace the gripper's target by up to 5 cm along the world's axes. The last opens
/// (positive) or closes the fingers; it has no effect in tasks that hold them closed. Observations
/// are [`FetchObservation`]s.
///
/// The reward may be any [`GoalReward`] ([`with_goal_reward`](Self::with_goal_reward)), and the
/// task one of your own ([`with_task`](Self::with_task)).
///
/// Episodes never end by themselves; [`TimeLimit`] ends them.
#[derive(Clone, Debug)]
pub struct FetchEnv<S: Simulator, R = DistanceReward, T: FetchTask<S> = Task> {
    pub(super) config: FetchConfig,
    pub(super) reward: R,
    pub(super) task: T,
    pub(super) simulator: S,
    /// Empty for a reward, a task or a model of the user's own, unless the user has set them.
    pub(super) symmetries: Vec<Symmetry>,
    action_space: BoxSpace<f32>,
    observation_space: Space,
    pub(super) lengths: Lengths,
    /// `None` until the first reset.
    pub(super) random: Option<NpRandom>,
    /// `None` until a reset.
    pub(super) goal: Option<Goal>,
    /// What the task remembers of the episode.
    pub(super) memory: T::Memory,
    /// What differs from the model in this episode.
    pub(super) varied: Varied,
    /// The number of episodes since the seed for which something was drawn beside `random`.
    pub(super) varied_episodes: u64,
    pub(super) interface: Interface,
}

impl<S: Simulator> FetchEnv<S> {
    /// Creates an environment in `simulator`, which must be made from
    /// [`config.sim()`](FetchConfig::sim).
    ///
    /// # Errors
    /// [`MakeError::SimulatorMismatch`] if the simulator was made from other settings.
    pub fn new(config: FetchConfig, simulator: S) -> Result<Self, MakeError> {
        config.check_simulator(&simulator)?;
        config.variation().check_built_in(&simulator)?;
        let task = config.task();
        let lengths = Lengths::of::<S>(&task);
        Ok(Self {
            reward: config.distance_reward(),
            action_space: BoxSpace::uniform(vec![ACTION_LEN], -1.0, 1.0)?,
            observation_space: observation_space(&config, lengths)?,
            lengths,
            config,
            task,
            simulator,
            symmetries: Vec::new(),
            random: None,
            goal: None,
            memory: (),
            varied: Varied::default(),
            varied_episodes: 0,
            interface: Interface::default(),
        }
        .with_own_symmetries())
    }
}

impl<S: Simulator, R, T: FetchTask<S>> FetchEnv<S, R, T> {
    /// Sets the reward, which also decides success, termination and truncation: it replaces the
    /// configuration's [`DistanceReward`]. The environment then has no
    /// [symmetries](GoalEnv::symmetries), because the reward may prefer one side, until
    /// [`with_symmetries`](Self::with_symmetries) sets them.
    ///
    /// ```
    /// use fetch_env::{Env, GoalEnvExt, GoalReward, make_kinematic};
    /// use fetch_env::goal_reward::goal_distance;
    ///
    /// /// 1 within 3 cm, and 0 elsewhere.
    /// struct Near;
    ///
    /// impl GoalReward for Near {
    ///     fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
    ///         f64::from(self.is_success(achieved_goal, desired_goal))
    ///     }
    ///     fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
    ///         goal_distance(achieved_goal, desired_goal) < 0.03
    ///     }
    /// }
    ///
    /// let mut env = make_kinematic("FetchReach-v4")?.into_inner().with_goal_reward(Near);
    /// env.reset(Some(0))?;
    /// assert_eq!(env.step(&[0.0; 4])?.reward, 0.0);
    /// assert_eq!(env.compute_reward(&[0.0; 3], &[0.0, 0.0, 0.02])?, 1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn with_goal_reward<Q: GoalReward>(self, reward: Q) -> FetchEnv<S, Q, T> {
        FetchEnv {
            config: self.config,
            reward,
            task: self.task,
            simulator: self.simulator,
            symmetries: Vec::new(),
            action_space: self.action_space,
            observation_space: self.observation_space,
            lengths: self.lengths,
            random: self.random,
            goal: self.goal,
            memory: self.memory,
            varied: self.varied,
            varied_episodes: self.varied_episodes,
            interface: self.interface,
        }
    }

    /// Sets the task: its goals, and what is observed besides the robot and the object. The
    /// previous task's episode is dropped, and so are its [symmetries](GoalEnv::symmetries);
    /// [`with_symmetries`](Self::with_symmetries) sets those of the new task.
    ///
    /// # Errors
    /// [`MakeError::EmptyGoal`] if goals have no elements, [`MakeError::Space`] if they or the extra
    /// elements are too many for a space.
    pub fn with_task<U: FetchTask<S>>(self, task: U) -> Result<FetchEnv<S, R, U>, MakeError> {
        let Self { config, reward, simulator, action_space, random, varied_episodes, .. } = self;
        let lengths = Lengths::of(&task);
        let observation_space = observation_space(&config, lengths)?;
        let goal = None;
        Ok(FetchEnv {
            config,
            reward,
            task,
            simulator,
            symmetries: Vec::new(),
            action_space,
            observation_space,
            lengths,
            random,
            goal,
            memory: U::Memory::default(),
            varied: Varied::default(),
            varied_episodes,
            interface: Interface::default(),
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

    /// Returns the goal of the episode, in meters in the built-in tasks; `None` until a reset.
    #[must_use]
    pub fn desired_goal(&self) -> Option<&[f64]> {
        self.goal.as_deref()
    }

    /// Returns the factors that were drawn or set for this episode; none until a reset.
    #[must_use]
    pub const fn variation(&self) -> &Varied {
        &self.varied
    }

    /// Returns the seed of the random numbers, whether the caller or the operating system provided
    /// it; `None` before the first reset.
    #[must_use]
    pub fn np_random_seed(&self) -> Option<u64> {
        self.random.as_ref().map(NpRandom::initial_seed)
    }

    /// Returns the random number generator as the last reset left it; `None` before the first
    /// reset.
    #[must_use]
    pub const fn np_random(&self) -> Option<&NpRandom> {
        self.random.as_ref()
    }
}

impl<S: Simulator, R: GoalReward, T: FetchTask<S>> FetchEnv<S, R, T> {
    /// Returns the current observation: that of the last reset or step, or of the restored
    /// snapshot.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before a reset and after a failure, and any error of the task.
    pub fn observe(&self) -> Result<FetchObservation, EnvError> {
        let mut observation = self.measure(self.goal.as_ref().ok_or(EnvError::ResetNeeded)?)?;
        self.interface.show(&mut observation);
        Ok(observation)
    }

    /// Returns the points that pictures mark as the goal, in meters in the world frame; empty until
    /// a reset.
    #[must_use]
    pub fn goal_positions(&self) -> Cow<'_, [[f64; 3]]> {
        self.goal.as_deref().map_or_else(Cow::default, |goal| self.task.goal_positions(goal))
    }

    /// Returns the observation of a state that the simulator has just reached.
    fn observe_next(&mut self, goal: &Goal) -> Result<FetchObservation, EnvError> {
        self.task.remember(&self.simulator, &mut self.memory)?;
        let mut observation = self.measure(goal)?;
        self.interface.observe(observation.observation());
        self.interface.show(&mut observation);
        Ok(observation)
    }

    /// Returns the observation of the current state, without delay.
    fn measure(&self, goal: &Goal) -> Result<FetchObservation, EnvError> {
        let Self { simulator, task, memory, .. } = self;
        let (gripper, object) = (simulator.gripper(), simulator.object());
        let period = simulator.control_period();
        let mut observation = FetchObservation::new(&gripper, object.as_ref(), period);
        task.achieved_goal(simulator, memory, observation.set_goals(goal))?;
        task.observe_extra(simulator, memory, observation.add_extra(self.lengths.extra))?;
        self.interface.disturb(&mut observation);
        Ok(observation)
    }

    fn info(&self, observation: &FetchObservation) -> Info {
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        Info::new(self.is_success(achieved, desired), goal_distance(achieved, desired))
    }

    /// Takes one action in double precision, as the reference does with an array of `float64`:
    /// clipped and scaled without rounding to `f32`. [`Env::step`] does it in single precision.
    ///
    /// ```
    /// use fetch_env::{Env, make_kinematic};
    ///
    /// let mut env = make_kinematic("FetchReach-v4")?.into_inner();
    /// env.reset(Some(0))?;
    /// let step = env.step_f64(&[0.1, 0.0, 0.0, 0.0])?;
    /// assert_eq!(step.reward, -1.0);
    /// # Ok::<(), fetch_env::EnvError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Env::step`].
    pub fn step_f64(&mut self, action: &[f64]) -> Result<Step<FetchObservation, Info>, EnvError> {
        self.take(action)
    }

    fn take(
        &mut self,
        action: &[impl Precision],
    ) -> Result<Step<FetchObservation, Info>, EnvError> {
        if self.goal.is_none() {
            return Err(EnvError::ResetNeeded);
        }
        let action = checked(action)?;
        let goal = self.goal.take().ok_or(EnvError::ResetNeeded)?;
        let control = control(self.interface.action(action));
        self.simulator.step(&self.interface.delay(control))?;
        let observation = self.observe_next(&goal)?;
        self.goal = Some(goal);
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        Ok(Step {
            reward: self.reward.reward(achieved, desired),
            terminated: self.compute_terminated(achieved, desired),
            truncated: self.compute_truncated(achieved, desired),
            info: self.info(&observation),
            observation,
        })
    }
}

impl<S: Simulator, R: GoalReward, T: FetchTask<S>> Env for FetchEnv<S, R, T> {
    type Observation = FetchObservation;
    type Info = Info;
    type ActionSpace = BoxSpace<f32>;
    type ResetOptions = FetchResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &FetchResetOptions,
    ) -> Result<Reset<FetchObservation, Info>, EnvError> {
        options.check(self.config.task(), self.lengths.goal)?;
        let mut random = match (seed, &self.random) {
            (Some(seed), _) => NpRandom::new(seed),
            (None, Some(random)) => random.clone(),
            (None, None) => NpRandom::from_entropy()?,
        };
        if seed.is_some() {
            self.varied_episodes = 0;
        }
        // There is no goal until everything has succeeded, so a failure requires another reset.
        self.goal = None;
        let goal = self.begin_episode(options, &mut random);
        self.random = Some(random);
        let goal = goal?;
        let observation = self.observe_next(&goal)?;
        self.goal = Some(goal);
        Ok(Reset { info: self.info(&observation), observation })
    }

    fn step(&mut self, action: &[f32]) -> Result<Step<FetchObservation, Info>, EnvError> {
        self.take(action)
    }

    fn action_space(&self) -> &BoxSpace<f32> {
        &self.action_space
    }

    fn observation_space(&self) -> &Space {
        &self.observation_space
    }
}

impl<S: Simulator, R: GoalReward, T: FetchTask<S>> GoalEnv for FetchEnv<S, R, T> {
    type GoalReward = R;

    fn goal_reward(&self) -> &R {
        &self.reward
    }

    fn symmetries(&self) -> Vec<Symmetry> {
        self.symmetries.clone()
    }
}
