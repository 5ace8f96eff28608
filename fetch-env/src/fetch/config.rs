use std::num::NonZeroU32;

use fetch_sim::{ModelSource, SimConfig, Task};
use goal_reward::{DistanceReward, DistanceThreshold, RewardKind, ThresholdError};
use serde::{Deserialize, Serialize};

/// The object starts at least this far from the gripper, in meters in the plane.
pub(crate) const MIN_OBJECT_DISTANCE: f64 = 0.1;
/// Goals in the air are at most this far above the table's, in meters.
pub(crate) const MAX_TARGET_RISE: f64 = 0.45;
/// The time step of all Fetch scenes, in seconds.
const PHYSICS_TIME_STEP: f64 = 0.002;
/// Below this range, in meters, hardly any draw (or none) is as far as [`MIN_OBJECT_DISTANCE`].
const MIN_OBJECT_RANGE: f64 = 0.075;

/// What a Fetch environment is made from.
///
/// [`new`](Self::new) gives the reference's numbers; [`builder`](Self::builder) changes them:
/// ```
/// use fetch_env::FetchConfig;
/// use fetch_sim::Task;
///
/// let config = FetchConfig::builder(Task::Push).distance_threshold(0.02).build()?;
/// assert_eq!(config.target_range(), 0.15);
/// assert!(FetchConfig::builder(Task::Reach).object_range(0.2).build().is_err());
/// # Ok::<(), fetch_env::ConfigError>(())
/// ```
/// Serializes as its builder does, and is checked when it is deserialized.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "FetchConfigBuilder", into = "FetchConfigBuilder")]
pub struct FetchConfig {
    sim: SimConfig,
    reward: DistanceReward,
    object_range: Option<f64>,
    target_range: f64,
    target_offset: [f64; 3],
    target_in_the_air: bool,
    max_episode_steps: NonZeroU32,
}

impl FetchConfig {
    /// The reference's configuration of a task.
    ///
    /// Source: the constructors in `envs/fetch/*.py` of gymnasium-robotics 1.4.2 and its registry.
    #[must_use]
    pub fn new(task: Task, reward: RewardKind) -> Self {
        let spec = task.spec();
        Self {
            sim: SimConfig::new(task),
            reward: DistanceReward::new(reward, DistanceThreshold::FETCH),
            object_range: default_object_range(task),
            target_range: spec.goal.range,
            target_offset: spec.goal.offset,
            target_in_the_air: spec.goal.in_the_air,
            max_episode_steps: NonZeroU32::new(50).expect("50 is not 0"),
        }
    }

    /// Starts from the reference's configuration of a task with the sparse reward.
    pub fn builder(task: Task) -> FetchConfigBuilder {
        Self::new(task, RewardKind::Sparse).into()
    }

    /// The task.
    #[must_use]
    pub const fn task(&self) -> Task {
        self.sim.task
    }

    /// What to make the simulator from.
    #[must_use]
    pub const fn sim(&self) -> &SimConfig {
        &self.sim
    }

    /// Duration of a control step, in seconds.
    #[must_use]
    pub fn control_period(&self) -> f64 {
        f64::from(self.sim.n_substeps.get()) * PHYSICS_TIME_STEP
    }

    /// The reward: its kind and distance threshold.
    #[must_use]
    pub const fn reward(&self) -> DistanceReward {
        self.reward
    }

    /// The object starts within this distance of the gripper in x and in y, in meters; `None`
    /// without an object.
    #[must_use]
    pub const fn object_range(&self) -> Option<f64> {
        self.object_range
    }

    /// Goals lie within this distance of the gripper's start, plus
    /// [`target_offset`](Self::target_offset), along each axis, in meters. With an object, the
    /// goal's height is the object's instead.
    #[must_use]
    pub const fn target_range(&self) -> f64 {
        self.target_range
    }

    /// Added to every goal, in meters; with an object, z has no effect.
    #[must_use]
    pub const fn target_offset(&self) -> [f64; 3] {
        self.target_offset
    }

    /// Whether half of the goals are raised by up to 0.45 m; always false without an object, whose
    /// goals are in the air anyway.
    #[must_use]
    pub const fn target_in_the_air(&self) -> bool {
        self.target_in_the_air
    }

    /// Steps after which an episode is truncated.
    #[must_use]
    pub const fn max_episode_steps(&self) -> NonZeroU32 {
        self.max_episode_steps
    }
}

fn default_object_range(task: Task) -> Option<f64> {
    task.spec().object.map(|object| object.range)
}

/// Builds a [`FetchConfig`]; the methods are named after what they set, see there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename = "FetchConfig", deny_unknown_fields)]
#[must_use]
pub struct FetchConfigBuilder {
    task: Task,
    #[serde(default)]
    model: ModelSource,
    #[serde(default = "on")]
    contact_filter: bool,
    n_substeps: u32,
    reward: RewardKind,
    distance_threshold: f64,
    object_range: Option<f64>,
    target_range: f64,
    target_offset: [f64; 3],
    target_in_the_air: bool,
    max_episode_steps: u32,
}

const fn on() -> bool {
    true
}

impl FetchConfigBuilder {
    /// Physics steps of 0.002 s per control step; 20 by default.
    pub const fn n_substeps(mut self, n_substeps: u32) -> Self {
        self.n_substeps = n_substeps;
        self
    }

    /// Where the robot's model comes from; the built-in one by default.
    pub fn model(mut self, model: ModelSource) -> Self {
        self.model = model;
        self
    }

    /// Whether MuJoCo's collision tests that would find nothing are left out, which changes no
    /// result; true by default.
    pub const fn contact_filter(mut self, contact_filter: bool) -> Self {
        self.contact_filter = contact_filter;
        self
    }

    /// Sparse or dense; sparse by default.
    pub const fn reward(mut self, reward: RewardKind) -> Self {
        self.reward = reward;
        self
    }

    /// The distance within which a goal counts as reached, in meters; 0.05 by default.
    pub const fn distance_threshold(mut self, meters: f64) -> Self {
        self.distance_threshold = meters;
        self
    }

    /// See [`FetchConfig::object_range`]; 0.15 by default, 0.1 for Slide.
    pub const fn object_range(mut self, meters: f64) -> Self {
        self.object_range = Some(meters);
        self
    }

    /// See [`FetchConfig::target_range`]; 0.15 by default, 0.3 for Slide.
    pub const fn target_range(mut self, meters: f64) -> Self {
        self.target_range = meters;
        self
    }

    /// See [`FetchConfig::target_offset`]; zero by default, 0.4 in x for Slide.
    pub const fn target_offset(mut self, meters: [f64; 3]) -> Self {
        self.target_offset = meters;
        self
    }

    /// See [`FetchConfig::target_in_the_air`]; true by default for PickAndPlace alone.
    pub const fn target_in_the_air(mut self, target_in_the_air: bool) -> Self {
        self.target_in_the_air = target_in_the_air;
        self
    }

    /// Steps after which an episode is truncated; 50 by default.
    pub const fn max_episode_steps(mut self, steps: u32) -> Self {
        self.max_episode_steps = steps;
        self
    }

    /// Checks the numbers.
    ///
    /// # Errors
    /// [`ConfigError`] for the first that cannot be.
    pub fn build(self) -> Result<FetchConfig, ConfigError> {
        let task = self.task;
        let not_zero = |option, number| NonZeroU32::new(number).ok_or(ConfigError::Zero { option });
        if !task.has_object() {
            let object_options = [
                ("object_range", self.object_range.is_some()),
                ("target_in_the_air", self.target_in_the_air),
            ];
            if let Some((option, _)) = object_options.into_iter().find(|(_, is_set)| *is_set) {
                return Err(ConfigError::NoObject { task, option });
            }
        }
        let object_range = self.object_range.or(default_object_range(task));
        for (option, range, least) in [
            ("object_range", object_range, MIN_OBJECT_RANGE),
            ("target_range", Some(self.target_range), 0.0),
        ] {
            // Doubled, as the width of the interval that is drawn from.
            if let Some(value) =
                range.filter(|&range| !((2.0 * range).is_finite() && range >= least))
            {
                return Err(ConfigError::Range { option, value, least });
            }
        }
        if let Some(axis) = self.target_offset.iter().position(|offset| !offset.is_finite()) {
            return Err(ConfigError::Offset { axis, value: self.target_offset[axis] });
        }
        let threshold = DistanceThreshold::new(self.distance_threshold)?;
        Ok(FetchConfig {
            sim: SimConfig {
                task,
                n_substeps: not_zero("n_substeps", self.n_substeps)?,
                model: self.model,
                contact_filter: self.contact_filter,
            },
            reward: DistanceReward::new(self.reward, threshold),
            object_range,
            target_range: self.target_range,
            target_offset: self.target_offset,
            target_in_the_air: self.target_in_the_air,
            max_episode_steps: not_zero("max_episode_steps", self.max_episode_steps)?,
        })
    }
}

impl From<FetchConfig> for FetchConfigBuilder {
    fn from(config: FetchConfig) -> Self {
        Self {
            task: config.sim.task,
            model: config.sim.model,
            contact_filter: config.sim.contact_filter,
            n_substeps: config.sim.n_substeps.get(),
            reward: config.reward.kind(),
            distance_threshold: config.reward.threshold().get(),
            object_range: config.object_range,
            target_range: config.target_range,
            target_offset: config.target_offset,
            target_in_the_air: config.target_in_the_air,
            max_episode_steps: config.max_episode_steps.get(),
        }
    }
}

impl TryFrom<FetchConfigBuilder> for FetchConfig {
    type Error = ConfigError;

    fn try_from(builder: FetchConfigBuilder) -> Result<Self, ConfigError> {
        builder.build()
    }
}

/// Why a configuration cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// An option about the object of a task that has none.
    #[error("{task} has no object, so {option} cannot be set: leave it out")]
    NoObject {
        /// The task.
        task: Task,
        /// The option.
        option: &'static str,
    },
    /// A range that nothing can be drawn from.
    #[error("{option} is {value}: give a finite number of meters, at least {least}")]
    Range {
        /// The option.
        option: &'static str,
        /// Its value, in meters.
        value: f64,
        /// The least that it can be, in meters.
        least: f64,
    },
    /// An offset that is NaN or infinite.
    #[error("target_offset[{axis}] is {value}: give a finite number of meters")]
    Offset {
        /// Index of the axis: x, y, z.
        axis: usize,
        /// The offset, in meters.
        value: f64,
    },
    /// The distance threshold is negative or not finite.
    #[error(transparent)]
    Threshold(#[from] ThresholdError),
    /// A count that must not be zero.
    #[error("{option} is 0: give at least 1")]
    Zero {
        /// The option.
        option: &'static str,
    },
}
