//! What a controller sees and what it commands.

use fetch_env::{FetchObservation, GoalObservation};
use nalgebra::Vector3;

use crate::policy::Action;

/// Seconds of a control step. Observed velocities are per step.
const CONTROL_PERIOD: f64 = 0.04;

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
    pub(super) fn new(observation: &FetchObservation) -> Self {
        let object = observation.object_position().zip(observation.object_relative_velocity());
        Self {
            gripper: observation.grip_position().into(),
            goal: Vector3::from_column_slice(observation.desired_goal()),
            object: object.map(|(position, velocity)| ObjectView {
                position: position.into(),
                // The observed velocity is relative to the gripper's.
                velocity: (Vector3::from(velocity) + Vector3::from(observation.grip_velocity()))
                    / CONTROL_PERIOD,
            }),
        }
    }
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

    pub(super) fn action(self) -> Action {
        let [x, y, z] = self.displacement.into();
        [x, y, z, self.fingers].map(|value| value.clamp(-1.0, 1.0) as f32)
    }
}
