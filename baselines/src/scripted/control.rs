//! What a controller sees and what it commands.

use fetch_env::{FetchObservation, GoalObservation, ObservationField, Space, Task};
use her_relabel::Scalar;
use nalgebra::Vector3;

use crate::dims::lengths_of;
use crate::policy::PolicyError;

/// Seconds of a control step. Observed velocities are per step.
const CONTROL_PERIOD: f64 = 0.04;

/// The number of elements of an action.
const ACTION_LEN: usize = 4;

/// The number of elements of a position, with which a goal begins.
const POSITION_LEN: usize = 3;

/// Where the columns that a controller reads are in its task's observations: the indices of their
/// first elements. Observations of other tasks may have more columns after these.
#[derive(Clone, Copy, Debug)]
pub(super) struct Columns {
    gripper: usize,
    gripper_velocity: usize,
    object: Option<ObjectColumns>,
    /// The number of all columns of the task.
    len: usize,
}

#[derive(Clone, Copy, Debug)]
struct ObjectColumns {
    position: usize,
    relative_velocity: usize,
}

impl Columns {
    pub(super) fn of(task: Task) -> Self {
        let start = |name| ObservationField::find(task, name).map(|field| field.range.start);
        let object = start("object_pos").zip(start("object_velp"));
        let len = FetchObservation::len_of(task);
        Self {
            // Every task has both fields.
            gripper: start("grip_pos").unwrap_or(len),
            gripper_velocity: start("grip_velp").unwrap_or(len),
            object: object
                .map(|(position, relative_velocity)| ObjectColumns { position, relative_velocity }),
            len,
        }
    }

    /// Checks that observations have the columns, and that actions are those of the controller.
    pub(super) fn check_spaces(
        &self,
        task: Task,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        let actual = lengths_of(observation_space, action_space)?;
        let expected = [self.len, POSITION_LEN, ACTION_LEN];
        let has_columns = actual.iter().zip(&expected).all(|(actual, least)| actual >= least);
        if has_columns && actual[2] == ACTION_LEN {
            return Ok(());
        }
        Err(PolicyError::Scripted { task, expected, actual })
    }
}

/// The parts of an observation.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub(super) gripper: Vector3<f64>,
    pub(super) goal: Vector3<f64>,
    pub(super) object: Option<ObjectView>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct ObjectView {
    pub(super) position: Vector3<f64>,
    /// Meters per second, in the world frame.
    pub(super) velocity: Vector3<f64>,
}

impl View {
    /// Returns what a controller sees of an observation; `None` if the observation does not have
    /// its columns, or one of their numbers or of the goal's is not finite.
    pub(super) fn new<O: GoalObservation<Element: Scalar>>(
        columns: &Columns,
        observation: &O,
    ) -> Option<Self> {
        let elements = observation.observation();
        let read = elements.get(..columns.len)?;
        let goal = vector(observation.desired_goal(), 0)?;
        if !goal.iter().copied().chain(read.iter().map(|e| e.to_f64())).all(f64::is_finite) {
            return None;
        }
        let gripper_velocity = vector(elements, columns.gripper_velocity)?;
        let object = |object: &ObjectColumns| {
            Some(ObjectView {
                position: vector(elements, object.position)?,
                // The observed velocity is relative to the gripper's.
                velocity: (vector(elements, object.relative_velocity)? + gripper_velocity)
                    / CONTROL_PERIOD,
            })
        };
        Some(Self {
            gripper: vector(elements, columns.gripper)?,
            goal,
            object: columns.object.as_ref().and_then(object),
        })
    }
}

/// Returns three elements from `start` on.
fn vector<S: Scalar>(elements: &[S], start: usize) -> Option<Vector3<f64>> {
    let elements = elements.get(start..start + POSITION_LEN)?;
    Some(Vector3::from_iterator(elements.iter().map(|element| element.to_f64())))
}

/// An action before it is clipped.
#[derive(Clone, Copy, Debug)]
pub(super) struct Command {
    pub(super) displacement: Vector3<f64>,
    pub(super) fingers: f64,
}

pub(super) const OPEN: f64 = 1.0;
pub(super) const CLOSE: f64 = -1.0;

/// Action per meter of distance: one action moves the gripper by about 0.03 m.
pub(super) const GAIN: f64 = 20.0;

impl Command {
    pub(super) const HOLD: Self =
        Self { displacement: Vector3::new(0.0, 0.0, 0.0), fingers: CLOSE };

    /// Moves toward a point that is `distance` away (meters).
    pub(super) fn toward(distance: Vector3<f64>, fingers: f64) -> Self {
        Self { displacement: GAIN * distance, fingers }
    }

    /// Writes the action, clipped; NaN if there is none, because the controller cannot see.
    pub(super) fn write(command: Option<Self>, action: &mut [f32]) {
        let Some(Self { displacement, fingers }) = command else {
            return action.fill(f32::NAN);
        };
        let [x, y, z] = displacement.into();
        for (element, value) in action.iter_mut().zip([x, y, z, fingers]) {
            *element = value.clamp(-1.0, 1.0) as f32;
        }
    }
}
