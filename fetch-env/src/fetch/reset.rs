//! Resets of a Fetch environment: their options, and where the object starts.

use std::collections::BTreeMap;

use fetch_sim::{SimError, Task};
use serde::{Deserialize, Serialize};

use super::config::{MAX_METERS, MIN_OBJECT_DISTANCE, first_too_far};
use super::observation::Goal;
use super::variation::{error::VariationError, factor::Factor};
use crate::gym::{error::EnvError, np_random::NpRandom};

/// Options of the reset of a Fetch environment.
///
/// A reset draws what the options leave open. It also draws what they set, and then replaces it, so
/// that the stream of random numbers is the same with and without options. It refuses coordinates
/// beyond 1,000 m, as [`FetchConfig`](super::config::FetchConfig) does.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[must_use]
pub struct FetchResetOptions {
    desired_goal: Option<Goal>,
    object_position: Option<[f64; 2]>,
    object_height: Option<f64>,
    object_rotation: Option<[f64; 4]>,
    gripper_position: Option<[f64; 3]>,
    object_in_gripper: bool,
    variation: BTreeMap<Factor, f64>,
}

impl FetchResetOptions {
    /// Sets the goal, in meters in the world frame: three elements in the built-in tasks. By
    /// default it is drawn.
    pub fn with_desired_goal(mut self, meters: impl AsRef<[f64]>) -> Self {
        self.desired_goal = Some(Goal::from_slice(meters.as_ref()));
        self
    }

    /// Returns the goal, in meters in the world frame; `None` if it is drawn.
    #[must_use]
    pub fn desired_goal(&self) -> Option<&[f64]> {
        self.desired_goal.as_deref()
    }

    /// Sets the object's start: x and y in meters in the world frame, even off the table or under
    /// the gripper. By default it is drawn.
    pub const fn with_object_position(mut self, meters: [f64; 2]) -> Self {
        self.object_position = Some(meters);
        self
    }

    /// Sets the height of the object's center above the floor at its start, in meters. By default it
    /// lies on the table.
    pub const fn with_object_height(mut self, meters: f64) -> Self {
        self.object_height = Some(meters);
        self
    }

    /// Sets how the object is turned at its start: a quaternion `[w, x, y, z]` of any length but 0,
    /// relative to its default. `[(a / 2).cos(), 0, 0, (a / 2).sin()]` turns it by the angle `a`, in
    /// radians, about the vertical.
    pub const fn with_object_rotation(mut self, quaternion: [f64; 4]) -> Self {
        self.object_rotation = Some(quaternion);
        self
    }

    /// Sets where the gripper starts: x, y and z in meters in the world frame. The arm moves there
    /// before the episode begins, with the object out of its way, which takes as long as about 16
    /// steps. By default it starts where the scene has settled.
    pub const fn with_gripper_position(mut self, meters: [f64; 3]) -> Self {
        self.gripper_position = Some(meters);
        self
    }

    /// Lets the gripper hold the object at the start. The gripper must not be blocked, as it is in
    /// Push and Slide.
    pub const fn with_object_in_gripper(mut self, held: bool) -> Self {
        self.object_in_gripper = held;
        self
    }

    /// Sets a factor, such as `"object_mass"`, for the episode, whether or not the environment's
    /// [variation](crate::FetchConfig::with_variation) draws it.
    pub fn with_factor(mut self, factor: impl Into<Factor>, value: f64) -> Self {
        self.variation.insert(factor.into(), value);
        self
    }

    /// Returns the factors that are set.
    pub const fn factors(&self) -> &BTreeMap<Factor, f64> {
        &self.variation
    }

    settings! {
        /// Returns the object's start: x and y in meters in the world frame; `None` if it is drawn.
        object_position: Option<[f64; 2]>;
        /// Returns the height of the object's center at its start, in meters; `None` if it lies on the
        /// table.
        object_height: Option<f64>;
        /// Returns how the object is turned at its start: a quaternion `[w, x, y, z]`.
        object_rotation: Option<[f64; 4]>;
        /// Returns where the gripper starts, in meters in the world frame; `None` if it starts where
        /// the scene has settled.
        gripper_position: Option<[f64; 3]>;
        /// Whether the gripper holds the object at the start.
        object_in_gripper: bool;
    }

    pub(super) fn check(&self, task: Task, goal_len: usize) -> Result<(), EnvError> {
        let lies = self.object_position.is_some()
            || self.object_height.is_some()
            || self.object_rotation.is_some();
        if (lies || self.object_in_gripper) && !task.has_object() {
            return Err(SimError::NoObject { task }.into());
        }
        let unfit = |option, reason| Err(EnvError::OptionUnfit { option, reason });
        if self.object_in_gripper && task.block_gripper() {
            let reason = "needs fingers that open, and this task keeps them closed: leave it out";
            return unfit("object_in_gripper", reason);
        }
        if self.object_in_gripper && lies {
            let reason = "says where the object is: leave the object's position, height and \
                          rotation out";
            return unfit("object_in_gripper", reason);
        }
        if self.object_rotation.is_some_and(|quaternion| quaternion == [0.0; 4]) {
            let reason = "has the length 0: pass a quaternion [w, x, y, z], such as [1, 0, 0, 0]";
            return unfit("object_rotation", reason);
        }
        let desired_goal = self.desired_goal().unwrap_or_default();
        if self.desired_goal.is_some() && desired_goal.len() != goal_len {
            let (expected, actual) = (goal_len, desired_goal.len());
            return Err(EnvError::OptionLength { option: "desired_goal", expected, actual });
        }
        for (factor, &value) in &self.variation {
            let [least, most] = factor.bounds();
            if !(least..=most).contains(&value) {
                let factor = factor.to_string();
                return Err(VariationError::OutOfRange { factor, value, least, most }.into());
            }
        }
        for (option, numbers) in [
            ("desired_goal", desired_goal),
            ("object_position", self.object_position.as_slice().as_flattened()),
            ("object_height", self.object_height.as_slice()),
            ("object_rotation", self.object_rotation.as_slice().as_flattened()),
            ("gripper_position", self.gripper_position.as_slice().as_flattened()),
        ] {
            if let Some((index, value)) = first_too_far(numbers) {
                return Err(EnvError::OptionOutside { option, index, value, most: MAX_METERS });
            }
        }
        Ok(())
    }
}

/// Draws positions of the object around the gripper until one is far enough away.
///
/// Source: `_reset_sim` of gymnasium-robotics 1.4.2.
pub(super) fn draw_object_position(
    range: f64,
    gripper: [f64; 2],
    random: &mut NpRandom,
) -> [f64; 2] {
    loop {
        let place = gripper.map(|coordinate| coordinate + random.uniform(-range, range));
        // Subtracting the gripper again keeps the rounding of the sum, as the reference does.
        let [x, y] = [place[0] - gripper[0], place[1] - gripper[1]];
        if (x * x + y * y).sqrt() >= MIN_OBJECT_DISTANCE {
            return place;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use fetch_sim::Settled;
    use goal_reward::RewardKind;
    use proptest::prelude::*;

    use super::*;
    use crate::fetch::{config::FetchConfig, task::draw_goal};

    /// The start of an episode.
    #[derive(Debug, PartialEq, Deserialize)]
    struct Start {
        object_position: Option<[f64; 2]>,
        desired_goal: [f64; 3],
    }

    impl Start {
        /// Draws a start in the reference's order.
        fn draw(config: &FetchConfig, settled: &Settled, random: &mut NpRandom) -> Self {
            let gripper = settled.gripper_position.xy().into();
            let draw = |range| draw_object_position(range, gripper, random);
            let object_position = config.object_range().map(draw);
            Self { object_position, desired_goal: draw_goal(config, settled, random) }
        }
    }

    #[derive(Deserialize)]
    struct Recording {
        tasks: HashMap<Task, RecordedTask>,
    }

    #[derive(Deserialize)]
    struct RecordedTask {
        initial_gripper_xpos: [f64; 3],
        height_offset: Option<f64>,
        starts: Vec<RecordedStarts>,
    }

    #[derive(Deserialize)]
    struct RecordedStarts {
        seed: u64,
        episodes: [Start; 2],
    }

    #[test]
    fn every_recorded_start_of_the_reference_is_reproduced_to_the_last_bit()
    -> Result<(), serde_json::Error> {
        let recording = include_str!("../../tests/fixtures/episode_starts.json");
        let recording: Recording = serde_json::from_str(recording)?;
        assert_eq!(recording.tasks.len(), Task::ALL.len());
        for (task, recorded) in recording.tasks {
            let config = FetchConfig::new(task, RewardKind::Sparse);
            let settled = Settled {
                gripper_position: recorded.initial_gripper_xpos.into(),
                object_height: recorded.height_offset,
            };
            for RecordedStarts { seed, episodes } in recorded.starts {
                let mut random = NpRandom::new(seed);
                for start in episodes {
                    let drawn = Start::draw(&config, &settled, &mut random);
                    assert_eq!(drawn, start, "{task}, seed {seed}");
                }
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn starts_lie_in_the_configured_ranges(
            seed: u64,
            task in prop::sample::select(Task::ALL.to_vec()),
            gripper in prop::array::uniform3(-2.0..2.0),
            object_range in 0.075..0.3,
            target_range in 0.0..0.3,
            target_offset in prop::array::uniform3(-0.5..0.5),
        ) {
            const ROUNDING: f64 = 1e-15;
            let mut config = FetchConfig::new(task, RewardKind::Sparse)
                .with_target_range(target_range)?
                .with_target_offset(target_offset)?;
            if task.has_object() {
                config = config.with_object_range(object_range)?.with_target_in_the_air(true)?;
            }
            let object_height = task.has_object().then_some(0.4);
            let settled = Settled { gripper_position: gripper.into(), object_height };
            let start = Start::draw(&config, &settled, &mut NpRandom::new(seed));

            prop_assert_eq!(start.object_position.is_some(), task.has_object());
            if let Some([x, y]) = start.object_position {
                let (dx, dy) = (x - gripper[0], y - gripper[1]);
                prop_assert!(dx.hypot(dy) >= 0.1 - ROUNDING);
                prop_assert!(dx.abs().max(dy.abs()) <= object_range + ROUNDING);
            }
            let free_axes = if task.has_object() { 2 } else { 3 };
            for axis in 0..free_axes {
                let offset = start.desired_goal[axis] - gripper[axis] - target_offset[axis];
                prop_assert!(offset.abs() <= target_range + ROUNDING);
            }
            if task.has_object() {
                prop_assert!((0.4..0.85).contains(&start.desired_goal[2]));
            }
        }
    }
}
