use fetch_env::{FetchObservation, GoalObservation};
use nalgebra::Vector3;

/// Seconds per control step: velocities are observed per step.
const CONTROL_PERIOD: f64 = 0.04;

/// An observation, taken apart.
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
                // Observed relative to the gripper's velocity.
                velocity: (Vector3::from(velocity) + Vector3::from(observation.grip_velocity()))
                    / CONTROL_PERIOD,
            }),
        }
    }
}
