//! Observations of a Fetch environment.

use fetch_sim::{GripperState, LARGEST_NUMBER, ObjectState, SimError, Simulator, Task};
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

use super::config::FetchConfig;
use super::error::MakeError;
use super::euler::matrix_to_euler;
use super::layout::{OBJECT, ObservationField, REACH, start};
use super::task::FetchTask;
use crate::gym::env::observation::{BatchObservation, GoalObservation, GoalRows};
use crate::gym::spaces::{DictSpace, Space, box_space::BoxSpace};

/// Number of elements of an observation without an object.
const REACH_LEN: usize = REACH[REACH.len() - 1].range.end;
/// Number of elements of an observation with an object.
const OBJECT_LEN: usize = OBJECT[OBJECT.len() - 1].range.end;

/// A goal, stored inline up to eight elements so that an observation needs no allocation.
pub(super) type Goal = SmallVec<[f64; 8]>;

/// Checks the numbers of an episode's goal, whether a task or a snapshot has set it.
pub(super) fn check_goal(goal: &[f64]) -> Result<(), SimError> {
    let (least, most) = (-LARGEST_NUMBER, LARGEST_NUMBER);
    let outside = goal.iter().copied().find(|number| !(least..=most).contains(number));
    outside.map_or(Ok(()), |value| {
        Err(SimError::OutOfRange { what: "an element of the goal", value, least, most })
    })
}

/// The numbers of elements that a task says it writes, when it is set.
#[derive(Clone, Copy, Debug)]
pub(super) struct Lengths {
    pub(super) goal: usize,
    pub(super) extra: usize,
}

impl Lengths {
    pub(super) fn of<S: Simulator>(task: &impl FetchTask<S>) -> Self {
        Self { goal: task.goal_len(), extra: task.extra_len() }
    }
}

/// Observation of a Fetch environment.
///
/// `achieved_goal` (3 elements, meters) is the gripper's position in Reach and the object's in the
/// other tasks; `desired_goal` (3 elements, meters) is the episode's goal. In a task of your own
/// they are what its [`FetchTask`](super::task::FetchTask) defines. `observation` holds, in the
/// world frame (x forward from the base, y to its left, z up),
///
/// | Push, PickAndPlace, Slide | Reach | name | unit | meaning |
/// |---|---|---|---|---|
/// | 0-2 | 0-2 | `grip_pos` | m | position of the grip site, between the fingers |
/// | 3-5 | - | `object_pos` | m | position of the object's center |
/// | 6-8 | - | `object_rel_pos` | m | `object_pos - grip_pos` |
/// | 9-10 | 3-4 | `gripper_state` | m | right and left finger joint; 0 is closed, 0.05 open |
/// | 11-13 | - | `object_rot` | rad | XYZ Euler angles of the object |
/// | 14-16 | - | `object_velp` | m/step | the object's velocity minus the gripper's |
/// | 17-19 | - | `object_velr` | rad/step | angular velocity of the object |
/// | 20-22 | 5-7 | `grip_velp` | m/step | velocity of the grip site |
/// | 23-24 | 8-9 | `gripper_vel` | m/step | velocities of the right and left finger joint |
///
/// A step is a control step: velocities per step are velocities per second times
/// [`control_period`](fetch_sim::Simulator::control_period), 0.04 s by default.
/// [`observation_fields`](super::layout::observation_fields) returns the table at run time. The
/// extra elements of a task of your own follow these.
///
/// Source: `_get_obs` of gymnasium-robotics 1.4.2; its own table says "m/s".
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct FetchObservation {
    has_object: bool,
    observation: Elements,
    achieved_goal: Goal,
    desired_goal: Goal,
}

/// The elements, stored inline up to 64 so that an observation needs no allocation.
type Elements = SmallVec<[f64; 64]>;

/// Writes each value to the place of its field in a layout.
macro_rules! arrange {
    ($fields:ident: $($name:literal = $values:expr,)*) => {{
        let mut elements = [0.0; _];
        $(put(&mut elements, const { start(&$fields, $name) }, $values);)*
        elements
    }};
}

#[inline(always)]
fn put<const N: usize>(elements: &mut [f64], start: usize, values: [f64; N]) {
    elements[start..start + N].copy_from_slice(&values);
}

impl FetchObservation {
    /// Creates an observation with the elements of the table, and without goals.
    pub(super) fn new(
        gripper: &GripperState,
        object: Option<&ObjectState>,
        control_period: f64,
    ) -> Self {
        let grip_pos = gripper.position;
        let grip_velp = gripper.velocity * control_period;
        let gripper_vel = gripper.finger_velocities.map(|velocity| velocity * control_period);
        let observation = if let Some(object) = object {
            let elements: [f64; OBJECT_LEN] = arrange! { OBJECT:
                "grip_pos" = grip_pos.into(),
                "object_pos" = object.position.into(),
                "object_rel_pos" = (object.position - grip_pos).into(),
                "gripper_state" = gripper.finger_positions,
                "object_rot" = matrix_to_euler(&object.rotation),
                "object_velp" = (object.linear_velocity * control_period - grip_velp).into(),
                "object_velr" = (object.angular_velocity * control_period).into(),
                "grip_velp" = grip_velp.into(),
                "gripper_vel" = gripper_vel,
            };
            Elements::from_slice(&elements)
        } else {
            let elements: [f64; REACH_LEN] = arrange! { REACH:
                "grip_pos" = grip_pos.into(),
                "gripper_state" = gripper.finger_positions,
                "grip_velp" = grip_velp.into(),
                "gripper_vel" = gripper_vel,
            };
            Elements::from_slice(&elements)
        };
        Self {
            has_object: object.is_some(),
            observation,
            achieved_goal: Goal::new(),
            desired_goal: Goal::new(),
        }
    }

    /// Sets the desired goal, and returns room for an achieved goal of the same length.
    pub(super) fn set_goals(&mut self, desired_goal: &Goal) -> &mut [f64] {
        self.desired_goal = Goal::from_slice(desired_goal);
        self.achieved_goal.resize(desired_goal.len(), 0.0);
        &mut self.achieved_goal
    }

    /// Adds `len` elements after those of the table, and returns them.
    pub(super) fn add_extra(&mut self, len: usize) -> &mut [f64] {
        if len == 0 {
            return &mut []; // as in all built-in tasks
        }
        let start = self.observation.len();
        self.observation.resize(start + len, 0.0);
        &mut self.observation[start..]
    }

    /// Returns the fields of the elements, the elements and the achieved goal, to change these.
    pub(super) fn parts_mut(&mut self) -> (&'static [ObservationField], &mut [f64], &mut [f64]) {
        let fields: &[_] = if self.has_object { &OBJECT } else { &REACH };
        (fields, &mut self.observation, &mut self.achieved_goal)
    }

    /// Returns the number of elements of a task's `observation`.
    #[must_use]
    pub const fn len_of(task: Task) -> usize {
        if task.has_object() { OBJECT_LEN } else { REACH_LEN }
    }

    /// Returns the position of the gripper, in meters.
    #[must_use]
    pub fn grip_position(&self) -> [f64; 3] {
        self.take(const { [start(&REACH, "grip_pos"), start(&OBJECT, "grip_pos")] })
    }

    /// Returns the velocity of the gripper, in meters per control step.
    #[must_use]
    pub fn grip_velocity(&self) -> [f64; 3] {
        self.take(const { [start(&REACH, "grip_velp"), start(&OBJECT, "grip_velp")] })
    }

    /// Returns the positions of the right and left finger joint, in meters.
    #[must_use]
    pub fn finger_positions(&self) -> [f64; 2] {
        self.take(const { [start(&REACH, "gripper_state"), start(&OBJECT, "gripper_state")] })
    }

    /// Returns the position of the object, in meters; `None` in Reach.
    #[must_use]
    pub fn object_position(&self) -> Option<[f64; 3]> {
        self.take_of_object(const { start(&OBJECT, "object_pos") })
    }

    /// Returns the velocity of the object minus the gripper's, in meters per control step; `None`
    /// in Reach.
    #[must_use]
    pub fn object_relative_velocity(&self) -> Option<[f64; 3]> {
        self.take_of_object(const { start(&OBJECT, "object_velp") })
    }

    /// Copies the elements from an index on; the index depends on whether there is an object.
    fn take<const N: usize>(&self, [reach, object]: [usize; 2]) -> [f64; N] {
        let start = if self.has_object { object } else { reach };
        std::array::from_fn(|i| self.observation[start + i])
    }

    fn take_of_object(&self, start: usize) -> Option<[f64; 3]> {
        self.has_object.then(|| self.take([0, start]))
    }
}

/// Returns the observation space of a task.
pub(super) fn observation_space(
    config: &FetchConfig,
    lengths: Lengths,
) -> Result<Space, MakeError> {
    if lengths.goal == 0 {
        return Err(MakeError::EmptyGoal);
    }
    let vector = |len| BoxSpace::<f64>::unbounded(len).map(Space::from);
    let len = FetchObservation::len_of(config.task()).saturating_add(lengths.extra);
    let space = DictSpace::new([
        ("achieved_goal", vector(lengths.goal)?),
        ("desired_goal", vector(lengths.goal)?),
        ("observation", vector(len)?),
    ])?;
    Ok(space.into())
}

impl BatchObservation for FetchObservation {
    type Rows = GoalRows<f64>;
}

impl GoalObservation for FetchObservation {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.observation
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved_goal
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired_goal
    }

    /// Returns the position of the gripper, which all tasks have at the same place.
    fn position(observation: &[f64]) -> Option<[f64; 3]> {
        const START: usize = start(&REACH, "grip_pos");
        const { assert!(START == start(&OBJECT, "grip_pos")) };
        observation.get(START..START + 3)?.try_into().ok()
    }
}

/// A loaded observation, not yet checked.
#[derive(Deserialize)]
#[serde(rename = "FetchObservation", deny_unknown_fields)]
struct Saved {
    has_object: bool,
    observation: Elements,
    achieved_goal: Goal,
    desired_goal: Goal,
}

impl TryFrom<Saved> for FetchObservation {
    type Error = String;

    fn try_from(saved: Saved) -> Result<Self, String> {
        let Saved { has_object, observation, achieved_goal, desired_goal } = saved;
        let (len, least) = (observation.len(), if has_object { OBJECT_LEN } else { REACH_LEN });
        if len < least {
            return Err(format!("this observation must have at least {least} elements, not {len}"));
        }
        let goals = [achieved_goal.len(), desired_goal.len()];
        if goals[0] == 0 || goals[0] != goals[1] {
            return Err(format!("the goals must have the same length, at least 1, not {goals:?}"));
        }
        Ok(Self { has_object, observation, achieved_goal, desired_goal })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;
    use crate::fetch::layout::observation_fields;

    type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

    fn observation(task: Task) -> FetchObservation {
        let gripper = GripperState {
            position: Vector3::new(1.3, 0.7, 0.5),
            velocity: Vector3::new(0.1, -0.2, 0.3),
            finger_positions: [0.01, 0.02],
            finger_velocities: [0.5, -0.5],
        };
        let object = ObjectState {
            position: Vector3::new(1.2, 0.8, 0.4),
            rotation: Matrix3::identity(),
            linear_velocity: Vector3::new(1.0, 2.0, 3.0),
            angular_velocity: Vector3::new(4.0, 5.0, 6.0),
        };
        let object = task.has_object().then_some(&object);
        let mut observation = FetchObservation::new(&gripper, object, 0.04);
        let goal = Goal::from_slice(&[1.0, 0.9, 0.8]);
        observation.set_goals(&goal).copy_from_slice(&[1.2, 0.8, 0.4]);
        observation
    }

    #[test]
    fn the_fields_follow_each_other_without_a_gap() {
        for task in Task::ALL {
            let mut next = 0;
            for field in observation_fields(task) {
                assert_eq!(field.range.start, next, "{task}: {}", field.name);
                next = field.range.end;
            }
            assert_eq!(next, FetchObservation::len_of(task), "{task}");
            assert_eq!(observation(task).observation().len(), next, "{task}");
        }
    }

    #[test]
    fn an_observation_survives_json() -> Result {
        for task in Task::ALL {
            let observation = observation(task);
            let json = serde_json::to_string(&observation)?;
            assert_eq!(serde_json::from_str::<FetchObservation>(&json)?, observation);
        }
        for (json, reason) in [
            (
                r#"{"has_object":false,"observation":[1],"achieved_goal":[0],"desired_goal":[0]}"#,
                "at least 10 elements, not 1",
            ),
            (
                r#"{"has_object":false,"observation":[0,1,2,3,4,5,6,7,8,9],
                    "achieved_goal":[0],"desired_goal":[0,0]}"#,
                "not [1, 2]",
            ),
        ] {
            let refusal = serde_json::from_str::<FetchObservation>(json).expect_err(reason);
            assert!(refusal.to_string().contains(reason), "{refusal}");
        }
        Ok(())
    }

    #[test]
    fn the_documented_table_is_the_layout() {
        let source = include_str!("observation.rs");
        for field in observation_fields(Task::Push) {
            let indices =
                |field: &ObservationField| format!("{}-{}", field.range.start, field.range.end - 1);
            let reach = ObservationField::find(Task::Reach, field.name);
            let reach = reach.map_or_else(|| "-".into(), indices);
            let row = format!(
                "/// | {} | {reach} | `{}` | {} | ",
                indices(field),
                field.name,
                field.unit
            );
            assert!(source.contains(&row), "no line starts with {row}");
        }
    }
}
