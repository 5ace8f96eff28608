//! The settings of a Fetch environment.

use std::num::NonZeroU32;

use fetch_sim::{ModelSource, SimConfig, Substeps, Task};
use goal_reward::{DistanceReward, DistanceThreshold, RewardKind};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

use super::env_id::{EnvId, UnknownEnvId};
use super::error::ConfigError;
use crate::gym::settings::{getters, setters};

/// Smallest distance between the object's start and the gripper, in meters in the plane.
pub(super) const MIN_OBJECT_DISTANCE: f64 = 0.1;
/// Largest height of a goal in the air above the table's goals, in meters.
pub(super) const MAX_TARGET_RISE: f64 = 0.45;
/// Largest distance that a setting or an option may name, in meters: far beyond the robot's reach of
/// about 1.5 m, and small enough that a sum of a few of them is exact to a nanometer.
pub(super) const MAX_METERS: f64 = 1000.0;
/// Time step of all Fetch scenes, in seconds.
const PHYSICS_TIME_STEP: f64 = 0.002;
/// Smallest object range, in meters: below it hardly any draw reaches [`MIN_OBJECT_DISTANCE`].
const MIN_OBJECT_RANGE: f64 = 0.075;

/// Settings of a Fetch environment.
///
/// [`new`](Self::new) gives the reference's numbers, and the setters change them:
/// ```
/// use fetch_env::FetchConfig;
/// use fetch_sim::Task;
/// use goal_reward::RewardKind;
///
/// let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_distance_threshold(0.02);
/// assert_eq!(config.target_range(), 0.15);
/// config.check()?;
/// let config = FetchConfig::new(Task::Reach, RewardKind::Sparse).with_object_range(0.2);
/// assert!(config.check().is_err());
/// # Ok::<(), fetch_env::ConfigError>(())
/// ```
/// Setters accept any value. [`check`](Self::check) finds invalid ones; deserializing and
/// everything that makes an environment call it. No distance may exceed 1,000 m, where the robot
/// reaches about 1.5 m, and a control step may have at most 1,000 physics steps; see
/// [`Substeps`](fetch_sim::Substeps).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
// `Self` makes serde's derives inherent functions, which the impls below wrap.
#[serde(remote = "Self", deny_unknown_fields)]
#[must_use]
pub struct FetchConfig {
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

/// The parts of a [`FetchConfig`] whose types allow only valid values.
#[derive(Clone, Debug)]
pub(super) struct Parts {
    pub(super) sim: SimConfig,
    pub(super) reward: DistanceReward,
    pub(super) max_episode_steps: NonZeroU32,
}

impl FetchConfig {
    /// Creates the reference's settings for a task.
    ///
    /// Source: the constructors in `envs/fetch/*.py` of gymnasium-robotics 1.4.2 and its registry.
    pub fn new(task: Task, reward: RewardKind) -> Self {
        let spec = task.spec();
        Self {
            task,
            model: ModelSource::default(),
            contact_filter: true,
            n_substeps: 20,
            reward,
            distance_threshold: DistanceThreshold::FETCH.get(),
            object_range: spec.object.map(|object| object.range),
            target_range: spec.goal.range,
            target_offset: spec.goal.offset,
            target_in_the_air: spec.goal.in_the_air,
            max_episode_steps: 50,
        }
    }

    /// Sets the source of the robot's model. The default is the built-in one, which needs no files.
    pub fn with_model(mut self, model: ModelSource) -> Self {
        self.model = model;
        self
    }

    setters! {
        /// Sets whether MuJoCo skips collision tests that would find nothing, which changes no
        /// result. The default, true, is faster.
        with_contact_filter(contact_filter: bool),
        /// Sets the number of physics steps of 0.002 s per control step. The default, 20, gives the
        /// reference's 25 Hz.
        with_n_substeps(n_substeps: u32),
        /// Sets the kind of reward.
        with_reward(reward: RewardKind),
        /// Sets the distance within which a goal counts as reached, in meters. The default, 0.05,
        /// is the reference's.
        with_distance_threshold(distance_threshold: f64),
    }

    /// Sets the largest distance between the object's start and the gripper in x and in y, in
    /// meters. The default is the reference's: 0.15, and 0.1 in Slide.
    pub const fn with_object_range(mut self, meters: f64) -> Self {
        self.object_range = Some(meters);
        self
    }

    setters! {
        /// Sets the largest distance along each axis between a goal and the gripper's start plus
        /// [`target_offset`](Self::target_offset), in meters; with an object, the goal's height is
        /// the object's instead. The default is the reference's: 0.15, and 0.3 in Slide.
        with_target_range(target_range: f64),
        /// Sets the offset of every goal, in meters. The default is the reference's: zero, and 0.4
        /// in x in Slide.
        with_target_offset(target_offset: [f64; 3]),
        /// Sets whether half of the goals are raised by up to 0.45 m. The default is the
        /// reference's: true in PickAndPlace alone.
        with_target_in_the_air(target_in_the_air: bool),
        /// Sets the number of steps after which an episode is truncated. The default, 50, is the
        /// reference's.
        with_max_episode_steps(max_episode_steps: u32),
    }

    /// The source of the robot's model.
    #[must_use]
    pub const fn model(&self) -> &ModelSource {
        &self.model
    }

    /// Duration of a control step, in seconds.
    #[must_use]
    pub fn control_period(&self) -> f64 {
        f64::from(self.n_substeps) * PHYSICS_TIME_STEP
    }

    getters! {
        /// The task.
        task: Task,
        /// Whether MuJoCo skips collision tests that would find nothing.
        contact_filter: bool,
        /// The number of physics steps per control step.
        n_substeps: u32,
        /// The kind of reward.
        reward: RewardKind,
        /// The distance within which a goal counts as reached, in meters.
        distance_threshold: f64,
        /// Largest distance of the object's start in x and y, in meters; `None` without an object.
        object_range: Option<f64>,
        /// Largest distance of a goal along each axis, in meters.
        target_range: f64,
        /// Offset of every goal, in meters; with an object, z has no effect.
        target_offset: [f64; 3],
        /// Whether half of the goals are raised by up to 0.45 m; always false without an object,
        /// whose goals are in the air anyway.
        target_in_the_air: bool,
        /// The number of steps after which an episode is truncated.
        max_episode_steps: u32,
    }

    /// Returns the settings of the simulator.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn sim(&self) -> Result<SimConfig, ConfigError> {
        Ok(self.parts()?.sim)
    }

    /// Checks all settings.
    ///
    /// # Errors
    /// [`ConfigError`] for the first invalid one.
    pub fn check(&self) -> Result<(), ConfigError> {
        self.parts().map(drop)
    }

    pub(super) fn parts(&self) -> Result<Parts, ConfigError> {
        let task = self.task;
        let count = |option, value, most| ConfigError::Count { option, value, most };
        for (option, is_set) in [
            ("object_range", self.object_range.is_some()),
            ("target_in_the_air", self.target_in_the_air),
        ] {
            if is_set && !task.has_object() {
                return Err(ConfigError::NoObject { task, option });
            }
        }
        for (option, range, least) in [
            ("object_range", self.object_range, MIN_OBJECT_RANGE),
            ("target_range", Some(self.target_range), 0.0),
        ] {
            let most = MAX_METERS;
            if let Some(value) = range.filter(|range| !(least..=most).contains(range)) {
                return Err(ConfigError::Range { option, value, least, most });
            }
        }
        if let Some((axis, value)) = first_too_far(&self.target_offset) {
            return Err(ConfigError::Offset { axis, value, most: MAX_METERS });
        }
        let threshold = DistanceThreshold::new(self.distance_threshold)?;
        let n_substeps = Substeps::new(self.n_substeps)
            .map_err(|_| count("n_substeps", self.n_substeps, Substeps::MAX.get()))?;
        let max_episode_steps = NonZeroU32::new(self.max_episode_steps)
            .ok_or_else(|| count("max_episode_steps", 0, u32::MAX))?;
        Ok(Parts {
            sim: SimConfig::new(task)
                .with_n_substeps(n_substeps)
                .with_model(self.model.clone())
                .with_contact_filter(self.contact_filter),
            reward: DistanceReward::new(self.reward, threshold),
            max_episode_steps,
        })
    }
}

/// Returns the first coordinate that is NaN or beyond [`MAX_METERS`], and its index.
pub(super) fn first_too_far(meters: &[f64]) -> Option<(usize, f64)> {
    let mut coordinates = meters.iter().copied().enumerate();
    coordinates.find(|(_, coordinate)| !(-MAX_METERS..=MAX_METERS).contains(coordinate))
}

impl Serialize for FetchConfig {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        Self::serialize(self, serializer)
    }
}

impl<'de> Deserialize<'de> for FetchConfig {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut config = Self::deserialize(deserializer)?;
        let default = Self::new(config.task, config.reward);
        config.object_range = config.object_range.or(default.object_range);
        config.check().map_err(D::Error::custom)?;
        Ok(config)
    }
}

impl EnvId {
    /// Returns the reference's settings for the environment.
    pub fn config(self) -> FetchConfig {
        FetchConfig::new(self.task, self.reward)
    }
}

impl From<EnvId> for FetchConfig {
    /// As [`EnvId::config`].
    fn from(id: EnvId) -> Self {
        id.config()
    }
}

impl TryFrom<&str> for FetchConfig {
    type Error = UnknownEnvId;

    /// Returns the reference's settings for the environment of this name.
    fn try_from(id: &str) -> Result<Self, UnknownEnvId> {
        Ok(id.parse::<EnvId>()?.config())
    }
}

impl TryFrom<&String> for FetchConfig {
    type Error = UnknownEnvId;

    fn try_from(id: &String) -> Result<Self, UnknownEnvId> {
        id.as_str().try_into()
    }
}
