//! The settings of a Fetch environment.

use std::num::NonZeroU32;

use fetch_sim::{ModelSource, SimConfig, Simulator, Substeps, Task};
use goal_reward::{DistanceReward, DistanceThreshold, RewardKind};
use serde::{Deserialize, Serialize};

use super::{env_id::EnvId, error::MakeError, variation::Variation};

/// Smallest horizontal distance between the object's start and the gripper, in meters.
pub(super) const MIN_OBJECT_DISTANCE: f64 = 0.1;
/// Largest height of a goal in the air above one on the table, in meters.
pub(super) const MAX_TARGET_RISE: f64 = 0.45;
/// Largest distance that a setting or an option may have, in meters: far beyond the robot's reach
/// of about 1.5 m, and small enough that the sum of a few distances is exact to a nanometer.
pub(super) const MAX_METERS: f64 = 1000.0;
/// Time step of all Fetch scenes, in seconds.
const PHYSICS_TIME_STEP: f64 = 0.002;
/// The reference's time limit, from its registry.
const MAX_EPISODE_STEPS: NonZeroU32 = NonZeroU32::new(50).expect("not zero");
/// Smallest object range, in meters: below it hardly any draw reaches [`MIN_OBJECT_DISTANCE`].
const MIN_OBJECT_RANGE: f64 = 0.075;

/// Settings of a Fetch environment, always valid.
///
/// [`new`](Self::new) gives the reference's numbers, and the setters change them. A setter returns
/// an error if its value is invalid:
/// ```
/// use fetch_env::{FetchConfig, MakeError, RewardKind, Task};
///
/// let config = FetchConfig::new(Task::Push, RewardKind::Sparse).with_distance_threshold(0.02)?;
/// assert_eq!(config.target_range(), 0.15);
/// let refused = FetchConfig::new(Task::Reach, RewardKind::Sparse).with_object_range(0.2);
/// assert!(matches!(refused, Err(MakeError::NoObject { .. })));
/// # Ok::<(), MakeError>(())
/// ```
/// No distance may exceed 1,000 m (the robot reaches about 1.5 m), and a control step may have at
/// most 1,000 physics steps; see [`Substeps`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
#[must_use]
pub struct FetchConfig {
    sim: SimConfig,
    reward: RewardKind,
    distance_threshold: DistanceThreshold,
    object_range: Option<f64>,
    target_range: f64,
    target_offset: [f64; 3],
    target_in_the_air: bool,
    max_episode_steps: NonZeroU32,
    #[serde(skip_serializing_if = "Variation::is_empty")]
    variation: Variation,
}

impl FetchConfig {
    /// Creates the reference's settings for a task.
    ///
    /// Source: the constructors in `envs/fetch/*.py` of gymnasium-robotics 1.4.2 and its registry.
    pub fn new(task: Task, reward: RewardKind) -> Self {
        let spec = task.spec();
        Self {
            sim: SimConfig::new(task),
            reward,
            distance_threshold: DistanceThreshold::FETCH,
            object_range: spec.object.map(|object| object.range),
            target_range: spec.goal.range,
            target_offset: spec.goal.offset,
            target_in_the_air: spec.goal.in_the_air,
            max_episode_steps: MAX_EPISODE_STEPS,
            variation: Variation::default(),
        }
    }

    /// Sets the source of the robot's model. The default is the built-in one, which needs no files.
    pub fn with_model(mut self, model: ModelSource) -> Self {
        self.sim = self.sim.with_model(model);
        self
    }

    /// Sets whether MuJoCo skips collision tests that would find nothing, which changes no result.
    /// The default, true, is faster.
    pub fn with_contact_filter(mut self, contact_filter: bool) -> Self {
        self.sim = self.sim.with_contact_filter(contact_filter);
        self
    }

    /// Sets the number of physics steps of 0.002 s per control step. The default, 20, gives the
    /// reference's 25 Hz.
    ///
    /// # Errors
    /// [`MakeError::Count`] unless it is from 1 to 1,000.
    pub fn with_n_substeps(mut self, n_substeps: u32) -> Result<Self, MakeError> {
        let count = |_| MakeError::Count {
            option: "n_substeps",
            value: n_substeps,
            most: Substeps::MAX.get(),
        };
        self.sim = self.sim.with_n_substeps(Substeps::new(n_substeps).map_err(count)?);
        Ok(self)
    }

    /// Sets the kind of reward.
    pub const fn with_reward(mut self, reward: RewardKind) -> Self {
        self.reward = reward;
        self
    }

    /// Sets the distance within which a goal counts as reached, in meters. The default, 0.05, is
    /// the reference's.
    ///
    /// # Errors
    /// [`MakeError::Threshold`] if it is negative or not finite.
    pub fn with_distance_threshold(mut self, meters: f64) -> Result<Self, MakeError> {
        self.distance_threshold = DistanceThreshold::new(meters)?;
        Ok(self)
    }

    /// Sets the largest distance between the object's start and the gripper in x and in y, in
    /// meters. The default is the reference's: 0.15, and 0.1 in Slide.
    ///
    /// # Errors
    /// [`MakeError::Range`] unless it is from 0.075 to 1,000, and
    /// [`MakeError::NoObject`] in Reach.
    pub fn with_object_range(mut self, meters: f64) -> Result<Self, MakeError> {
        self.check_object("object_range")?;
        self.object_range = Some(in_range("object_range", meters, MIN_OBJECT_RANGE)?);
        Ok(self)
    }

    /// Sets the largest distance along each axis between a goal and the gripper's start plus
    /// [`target_offset`](Self::target_offset), in meters; with an object, the goal's height is the
    /// object's instead. The default is the reference's: 0.15, and 0.3 in Slide.
    ///
    /// # Errors
    /// [`MakeError::Range`] unless it is from 0 to 1,000.
    pub fn with_target_range(mut self, meters: f64) -> Result<Self, MakeError> {
        self.target_range = in_range("target_range", meters, 0.0)?;
        Ok(self)
    }

    /// Sets the offset of every goal, in meters. The default is the reference's: zero, and 0.4 in x
    /// in Slide.
    ///
    /// # Errors
    /// [`MakeError::Offset`] unless each coordinate is from -1,000 to 1,000.
    pub fn with_target_offset(mut self, meters: [f64; 3]) -> Result<Self, MakeError> {
        if let Some((axis, value)) = first_too_far(&meters) {
            return Err(MakeError::Offset { axis, value, most: MAX_METERS });
        }
        self.target_offset = meters;
        Ok(self)
    }

    /// Sets whether half of the goals are raised by up to 0.45 m. The default is the reference's:
    /// true only in PickAndPlace.
    ///
    /// # Errors
    /// [`MakeError::NoObject`] if it is set in Reach.
    pub fn with_target_in_the_air(mut self, in_the_air: bool) -> Result<Self, MakeError> {
        if in_the_air {
            self.check_object("target_in_the_air")?;
        }
        self.target_in_the_air = in_the_air;
        Ok(self)
    }

    /// Sets the number of steps after which an episode is truncated. The default, 50, is the
    /// reference's.
    ///
    /// # Errors
    /// [`MakeError::Count`] if it is 0.
    pub fn with_max_episode_steps(mut self, steps: u32) -> Result<Self, MakeError> {
        let option = "max_episode_steps";
        self.max_episode_steps = NonZeroU32::new(steps).ok_or(MakeError::Count {
            option,
            value: steps,
            most: u32::MAX,
        })?;
        Ok(self)
    }

    /// Sets the factors that are drawn for each episode: none by default.
    pub fn with_variation(mut self, variation: Variation) -> Self {
        self.variation = variation;
        self
    }

    /// Returns the factors that are drawn for each episode.
    pub const fn variation(&self) -> &Variation {
        &self.variation
    }

    /// Returns the task.
    #[must_use]
    pub const fn task(&self) -> Task {
        self.sim.task()
    }

    /// Returns the settings of the simulator.
    pub const fn sim(&self) -> &SimConfig {
        &self.sim
    }

    /// Returns the duration of a control step, in seconds.
    #[must_use]
    pub fn control_period(&self) -> f64 {
        f64::from(self.sim.n_substeps().get()) * PHYSICS_TIME_STEP
    }

    /// Returns the reward as a function of the goals.
    pub const fn distance_reward(&self) -> DistanceReward {
        DistanceReward::new(self.reward, self.distance_threshold)
    }

    settings! {
        /// Returns the kind of reward.
        reward: RewardKind;
        /// Returns the distance within which a goal counts as reached.
        distance_threshold: DistanceThreshold;
        /// Returns the largest distance of the object's start in x and y, in meters; `None` without
        /// an object.
        object_range: Option<f64>;
        /// Returns the largest distance of a goal along each axis, in meters.
        target_range: f64;
        /// Returns the offset of every goal, in meters; with an object, z has no effect.
        target_offset: [f64; 3];
        /// Whether half of the goals are raised by up to 0.45 m; always false without an object,
        /// whose goals are in the air anyway.
        target_in_the_air: bool;
        /// Returns the number of steps after which an episode is truncated.
        max_episode_steps: NonZeroU32;
    }

    /// Checks that a simulator has been made from these settings, as far as it shows.
    pub(super) fn check_simulator(&self, simulator: &impl Simulator) -> Result<(), MakeError> {
        let settled = simulator.settled();
        let mismatch = |reason| Err(MakeError::SimulatorMismatch { reason });
        let (task, theirs) = (self.task(), simulator.task());
        if theirs != task {
            return mismatch(format!("it simulates {theirs}, the task is {task}"));
        }
        let (period, theirs) = (self.control_period(), simulator.control_period());
        if theirs != period {
            return mismatch(format!(
                "its steps last {theirs} s, they should last {period} s, with the model's time step \
                 at 0.002 s"
            ));
        }
        if settled.object_height.is_some() != task.has_object() {
            return mismatch(format!("the object's settled height is {:?}", settled.object_height));
        }
        Ok(())
    }

    const fn check_object(&self, option: &'static str) -> Result<(), MakeError> {
        let task = self.task();
        if task.has_object() { Ok(()) } else { Err(MakeError::NoObject { task, option }) }
    }
}

/// Returns a range of meters that is at least `least`.
fn in_range(option: &'static str, value: f64, least: f64) -> Result<f64, MakeError> {
    let most = MAX_METERS;
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(MakeError::Range { option, value, least, most })
}

/// Returns the first coordinate that is NaN or beyond [`MAX_METERS`], and its index.
pub(super) fn first_too_far(meters: &[f64]) -> Option<(usize, f64)> {
    let mut coordinates = meters.iter().copied().enumerate();
    coordinates.find(|(_, coordinate)| !(-MAX_METERS..=MAX_METERS).contains(coordinate))
}

/// Loaded settings, not yet checked.
#[derive(Deserialize)]
#[serde(rename = "FetchConfig", deny_unknown_fields)]
struct Saved {
    sim: SimConfig,
    reward: RewardKind,
    distance_threshold: f64,
    #[serde(default)]
    object_range: Option<f64>,
    target_range: f64,
    target_offset: [f64; 3],
    target_in_the_air: bool,
    max_episode_steps: u32,
    #[serde(default)]
    variation: Variation,
}

impl TryFrom<Saved> for FetchConfig {
    type Error = MakeError;

    fn try_from(saved: Saved) -> Result<Self, MakeError> {
        let mut config = Self::new(saved.sim.task(), saved.reward);
        config.sim = saved.sim;
        config.variation = saved.variation;
        if let Some(meters) = saved.object_range {
            config = config.with_object_range(meters)?;
        }
        config
            .with_distance_threshold(saved.distance_threshold)?
            .with_target_range(saved.target_range)?
            .with_target_offset(saved.target_offset)?
            .with_target_in_the_air(saved.target_in_the_air)?
            .with_max_episode_steps(saved.max_episode_steps)
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
    type Error = MakeError;

    /// Returns the reference's settings for the environment of this name.
    fn try_from(id: &str) -> Result<Self, MakeError> {
        Ok(id.parse::<EnvId>()?.config())
    }
}

impl TryFrom<&String> for FetchConfig {
    type Error = MakeError;

    fn try_from(id: &String) -> Result<Self, MakeError> {
        id.as_str().try_into()
    }
}
