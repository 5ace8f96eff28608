use std::ops::Range;

use fetch_sim::{GripperState, ObjectState, Task};
use serde::{Deserialize, Serialize};

use super::euler::matrix_to_euler;
use crate::GoalObservation;

/// Elements of an observation without an object.
const REACH_LEN: usize = 10;
/// Elements of an observation with an object.
const OBJECT_LEN: usize = 25;

/// What is observed in a Fetch environment.
///
/// `achieved_goal` (3 elements, meters) is the gripper's position in Reach and the object's
/// elsewhere; `desired_goal` (3 elements, meters) is the episode's goal. `observation` holds, in
/// the world frame (x forward from the base, y to its left, z up),
///
/// | Push, PickAndPlace, Slide | Reach | name | unit | what |
/// |---|---|---|---|---|
/// | 0-2 | 0-2 | `grip_pos` | m | position of the grip site, between the fingers |
/// | 3-5 | - | `object_pos` | m | position of the object's center |
/// | 6-8 | - | `object_rel_pos` | m | `object_pos - grip_pos` |
/// | 9-10 | 3-4 | `gripper_state` | m | right and left finger joint; 0 is closed, 0.05 open |
/// | 11-13 | - | `object_rot` | rad | XYZ Euler angles of the object |
/// | 14-16 | - | `object_velp` | m per step | the object's velocity minus the gripper's |
/// | 17-19 | - | `object_velr` | rad per step | angular velocity of the object |
/// | 20-22 | 5-7 | `grip_velp` | m per step | velocity of the grip site |
/// | 23-24 | 8-9 | `gripper_vel` | m per step | velocities of the right and left finger joint |
///
/// "Per step" is per control step: the velocity per second times
/// [`control_period`](fetch_sim::Simulator::control_period), 0.04 s by default.
/// [`observation_fields`] gives the table at run time.
///
/// Source: `_get_obs` of gymnasium-robotics 1.4.2; its own table says "m/s".
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Parts", into = "Parts")]
pub struct FetchObservation {
    observation: Vector,
    achieved_goal: [f64; 3],
    desired_goal: [f64; 3],
}

/// In line, so that an observation needs no allocation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Vector {
    Reach([f64; REACH_LEN]),
    Object([f64; OBJECT_LEN]),
}

impl FetchObservation {
    pub(crate) fn new(
        gripper: &GripperState,
        object: Option<&ObjectState>,
        desired_goal: [f64; 3],
        control_period: f64,
    ) -> Self {
        let grip_pos = gripper.position;
        let grip_velp = gripper.velocity * control_period;
        let gripper_vel = gripper.finger_velocities.map(|velocity| velocity * control_period);
        let [finger_r, finger_l] = gripper.finger_positions;
        let Some(object) = object else {
            let observation = concatenate(&[
                grip_pos.as_slice(),
                &[finger_r, finger_l],
                grip_velp.as_slice(),
                &gripper_vel,
            ]);
            return Self {
                observation: Vector::Reach(observation),
                achieved_goal: grip_pos.into(),
                desired_goal,
            };
        };
        let object_velp = object.linear_velocity * control_period - grip_velp;
        let observation = concatenate(&[
            grip_pos.as_slice(),
            object.position.as_slice(),
            (object.position - grip_pos).as_slice(),
            &[finger_r, finger_l],
            &matrix_to_euler(&object.rotation),
            object_velp.as_slice(),
            (object.angular_velocity * control_period).as_slice(),
            grip_velp.as_slice(),
            &gripper_vel,
        ]);
        Self {
            observation: Vector::Object(observation),
            achieved_goal: object.position.into(),
            desired_goal,
        }
    }

    /// The number of elements of a task's `observation`.
    #[must_use]
    pub const fn len_of(task: Task) -> usize {
        if task.has_object() { OBJECT_LEN } else { REACH_LEN }
    }

    /// Position of the gripper, in meters.
    #[must_use]
    pub fn grip_position(&self) -> [f64; 3] {
        take(self.observation())
    }

    /// Position of the object, in meters; `None` in Reach.
    #[must_use]
    pub fn object_position(&self) -> Option<[f64; 3]> {
        match &self.observation {
            Vector::Reach(_) => None,
            Vector::Object(observation) => Some(take(&observation[3..])),
        }
    }

    /// Positions of the right and left finger joint, in meters.
    #[must_use]
    pub fn finger_positions(&self) -> [f64; 2] {
        match &self.observation {
            Vector::Reach(observation) => take(&observation[3..]),
            Vector::Object(observation) => take(&observation[9..]),
        }
    }
}

impl GoalObservation for FetchObservation {
    fn observation(&self) -> &[f64] {
        match &self.observation {
            Vector::Reach(observation) => observation,
            Vector::Object(observation) => observation,
        }
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved_goal
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired_goal
    }
}

fn concatenate<const N: usize>(parts: &[&[f64]]) -> [f64; N] {
    let mut elements = parts.iter().copied().flatten();
    std::array::from_fn(|_| *elements.next().expect("the parts have N elements"))
}

fn take<const N: usize>(elements: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| elements[i])
}

#[derive(Serialize, Deserialize)]
#[serde(rename = "FetchObservation", deny_unknown_fields)]
struct Parts {
    observation: Vec<f64>,
    achieved_goal: [f64; 3],
    desired_goal: [f64; 3],
}

impl From<FetchObservation> for Parts {
    fn from(from: FetchObservation) -> Self {
        Self {
            observation: from.observation().into(),
            achieved_goal: from.achieved_goal,
            desired_goal: from.desired_goal,
        }
    }
}

impl TryFrom<Parts> for FetchObservation {
    type Error = String;

    fn try_from(parts: Parts) -> Result<Self, String> {
        let elements = parts.observation.as_slice();
        let observation = if let Ok(reach) = elements.try_into() {
            Vector::Reach(reach)
        } else if let Ok(object) = elements.try_into() {
            Vector::Object(object)
        } else {
            let len = elements.len();
            return Err(format!(
                "an observation has {REACH_LEN} or {OBJECT_LEN} elements, not {len}"
            ));
        };
        let Parts { achieved_goal, desired_goal, .. } = parts;
        Ok(Self { observation, achieved_goal, desired_goal })
    }
}

/// A run of elements of `observation` with one meaning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct ObservationField {
    /// The reference's name for it.
    pub name: &'static str,
    /// Which elements.
    pub range: Range<usize>,
    /// Unit of the elements.
    pub unit: &'static str,
    /// What they are.
    pub description: &'static str,
}

/// What a task's `observation` is made of, in order and without gaps; see [`FetchObservation`].
#[must_use]
pub const fn observation_fields(task: Task) -> &'static [ObservationField] {
    if task.has_object() { &OBJECT_FIELDS } else { &REACH_FIELDS }
}

const REACH_FIELDS: [ObservationField; 4] =
    [grip_pos(0), gripper_state(3), grip_velp(5), gripper_vel(8)];

const OBJECT_FIELDS: [ObservationField; 9] = [
    grip_pos(0),
    field("object_pos", 3..6, "m", "position of the object's center"),
    field("object_rel_pos", 6..9, "m", "position of the object relative to the gripper"),
    gripper_state(9),
    field("object_rot", 11..14, "rad", "XYZ Euler angles of the object"),
    field("object_velp", 14..17, "m/step", "velocity of the object relative to the gripper"),
    field("object_velr", 17..20, "rad/step", "angular velocity of the object"),
    grip_velp(20),
    gripper_vel(23),
];

const fn grip_pos(at: usize) -> ObservationField {
    field("grip_pos", at..at + 3, "m", "position of the grip site, between the fingers")
}

const fn gripper_state(at: usize) -> ObservationField {
    field("gripper_state", at..at + 2, "m", "right and left finger joint, 0 closed to 0.05 open")
}

const fn grip_velp(at: usize) -> ObservationField {
    field("grip_velp", at..at + 3, "m/step", "velocity of the grip site")
}

const fn gripper_vel(at: usize) -> ObservationField {
    field("gripper_vel", at..at + 2, "m/step", "velocities of the right and left finger joint")
}

const fn field(
    name: &'static str,
    range: Range<usize>,
    unit: &'static str,
    description: &'static str,
) -> ObservationField {
    ObservationField { name, range, unit, description }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

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
        FetchObservation::new(&gripper, object, [1.0, 0.9, 0.8], 0.04)
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
    fn an_observation_survives_json() {
        for task in Task::ALL {
            let observation = observation(task);
            let json = serde_json::to_string(&observation).expect("serializable");
            assert_eq!(serde_json::from_str::<FetchObservation>(&json).expect("one"), observation);
        }
        let json = r#"{"observation":[1.0],"achieved_goal":[0,0,0],"desired_goal":[0,0,0]}"#;
        let refusal = serde_json::from_str::<FetchObservation>(json).expect_err("1 element");
        assert!(refusal.to_string().contains("10 or 25 elements, not 1"), "{refusal}");
    }
}
