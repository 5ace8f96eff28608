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
        let values = observation.observation();
        let vector = |first: usize| Vector3::from_column_slice(&values[first..first + 3]);
        Self {
            gripper: vector(0),
            goal: Vector3::from_column_slice(observation.desired_goal()),
            object: (values.len() == 25).then(|| ObjectView {
                position: vector(3),
                // Observed relative to the gripper's velocity.
                velocity: (vector(14) + vector(20)) / CONTROL_PERIOD,
            }),
        }
    }
}
