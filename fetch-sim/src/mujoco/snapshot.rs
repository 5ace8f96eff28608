use nalgebra::{Quaternion, Vector3};
use serde::{Deserialize, Serialize};

use crate::{GripperState, ObjectState, SimConfig};

/// The complete state of a [`MujocoSimulator`](super::MujocoSimulator).
///
/// Besides MuJoCo's integration state it holds the derived quantities that outlive a step: the
/// next action starts from the gripper's pose, and the environment observes the states, as they
/// were computed at the last step; PickAndPlace's are one substep older than `qpos`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MujocoSnapshot {
    pub(super) config: SimConfig,
    pub(super) mujoco: String,
    pub(super) time: f64,
    pub(super) qpos: Vec<f64>,
    pub(super) qvel: Vec<f64>,
    pub(super) ctrl: Vec<f64>,
    pub(super) qacc_warmstart: Vec<f64>,
    pub(super) mocap_pose: (Vector3<f64>, Quaternion<f64>),
    pub(super) gripper_link_pose: (Vector3<f64>, Quaternion<f64>),
    pub(super) gripper: GripperState,
    pub(super) object: Option<ObjectState>,
}
