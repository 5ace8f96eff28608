//! The snapshot of a simulation.

use serde::{Deserialize, Serialize};

use crate::mujoco::binding::{data::Data, poses::Pose, version::MujocoVersion};
use crate::{
    bounds::first_outside,
    config::SimConfig,
    error::SimError,
    physics::Physics,
    simulator::{GripperState, ObjectState},
};

/// The complete state of a [`MujocoSimulator`](crate::MujocoSimulator).
///
/// In addition to MuJoCo's integration state it holds the derived quantities that outlive a step,
/// as the last step computed them: the next action starts from the gripper's pose, and the
/// environment observes the states. Those of PickAndPlace are one substep older than `qpos`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MujocoSnapshot {
    pub(super) config: SimConfig,
    pub(super) mujoco: String,
    pub(super) time: f64,
    pub(super) qpos: Vec<f64>,
    pub(super) qvel: Vec<f64>,
    pub(super) ctrl: Vec<f64>,
    /// The activations of actuators that have one.
    #[serde(default)]
    pub(super) act: Vec<f64>,
    pub(super) qacc_warmstart: Vec<f64>,
    /// The pose of each mocap body.
    pub(super) mocap_poses: Vec<Pose>,
    pub(super) gripper_link_pose: Pose,
    pub(super) gripper: GripperState,
    pub(super) object: Option<ObjectState>,
    /// The states of the model's other bodies that move.
    pub(super) moving: Vec<ObjectState>,
    /// What differs from the model's physics.
    #[serde(default)]
    pub(super) physics: Physics,
}

impl MujocoSnapshot {
    /// Checks that the snapshot is of a simulation with this configuration, data and number of
    /// other bodies that move, and that its numbers are ones that MuJoCo can take.
    pub(super) fn check(
        &self,
        config: &SimConfig,
        data: &Data,
        num_moving: usize,
    ) -> Result<(), SimError> {
        let foreign = |reason: String| Err(SimError::ForeignSnapshot { reason });
        if !self.config.same_physics(config) {
            return foreign(format!("it was taken from {:?}, this is {config:?}", self.config));
        }
        let version = MujocoVersion::of_shim().to_string();
        if self.mujoco != version {
            return foreign(format!("it was taken with MuJoCo {}, this is {version}", self.mujoco));
        }
        let fits = self.qpos.len() == data.qpos().len()
            && self.qvel.len() == data.qvel().len()
            && self.qacc_warmstart.len() == data.qacc_warmstart().len()
            && self.ctrl.len() == data.ctrl().len()
            && self.act.len() == data.act().len()
            && self.mocap_poses.len() == data.model().nmocap()
            && self.object.is_some() == config.task().has_object()
            && self.moving.len() == num_moving;
        if !fits {
            return foreign("its arrays have different lengths".into());
        }
        match first_outside(self.numbers()) {
            None => Ok(()),
            Some(number) => foreign(format!("it contains the number {number}")),
        }
    }

    fn numbers(&self) -> impl Iterator<Item = &f64> {
        let poses = self.mocap_poses.iter().chain([&self.gripper_link_pose]);
        [&self.qpos, &self.qvel, &self.ctrl, &self.act, &self.qacc_warmstart]
            .into_iter()
            .flatten()
            .chain([&self.time])
            .chain(poses.flat_map(|(at, orientation)| at.iter().chain(&orientation.coords)))
            .chain(self.gripper.numbers())
            .chain(self.object.iter().chain(&self.moving).flat_map(ObjectState::numbers))
    }
}
