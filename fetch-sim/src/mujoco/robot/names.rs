//! The names in a model of a Fetch task that the Fetch operations use, as ids.

use super::bodies::FREE;
use crate::mujoco::binding::{
    ids::{BodyId, JointId, SiteId},
    model::Model,
};
use crate::{error::SimError, task::Task};

/// The body to which the gripper is welded.
pub(super) const MOCAP: &str = "robot0:mocap";

/// Ids that the Fetch operations use.
#[derive(Debug)]
pub(crate) struct Ids {
    pub(crate) grip: SiteId,
    pub(crate) gripper_link: BodyId,
    /// The index of the mocap body among all.
    pub(crate) mocap: usize,
    /// Position and velocity addresses of the right and the left finger.
    pub(crate) fingers: [JointAddress; 2],
    pub(crate) object: Option<ObjectIds>,
    /// For each actuator, the index in `qpos` of its joint's position.
    pub(crate) actuated_qpos: Vec<usize>,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct JointAddress {
    pub(crate) qpos: usize,
    pub(crate) dof: usize,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct ObjectIds {
    pub(crate) site: SiteId,
    pub(crate) joint: JointId,
    pub(crate) qpos: usize,
}

impl Ids {
    pub(super) fn resolve(model: &Model, mocap: BodyId, task: Task) -> Result<Self, SimError> {
        let actuated = |joint: Option<JointId>| -> Result<usize, SimError> {
            let object = "an actuator".into();
            let joint = joint.ok_or(SimError::UnfitModel { object, reason: "drives no joint" })?;
            Ok(address(model, joint, AXIS)?.qpos)
        };
        let object = || -> Result<_, SimError> {
            let joint = model.joint("object0:joint")?;
            let JointAddress { qpos, .. } = address(model, joint, FREE)?;
            Ok(ObjectIds { site: model.site("object0")?, joint, qpos })
        };
        Ok(Self {
            grip: model.site("robot0:grip")?,
            gripper_link: model.body("robot0:gripper_link")?,
            mocap: model
                .mocap_index(mocap)?
                .ok_or_else(|| SimError::MissingName { kind: "mocap body", name: MOCAP.into() })?,
            fingers: [
                address(model, model.joint("robot0:r_gripper_finger_joint")?, AXIS)?,
                address(model, model.joint("robot0:l_gripper_finger_joint")?, AXIS)?,
            ],
            object: task.has_object().then(object).transpose()?,
            actuated_qpos: model.actuator_joints().map(actuated).collect::<Result<_, _>>()?,
        })
    }
}

/// Coordinates of a slide or a hinge.
pub(super) const AXIS: usize = 1;

/// Returns the addresses of a joint that must have a number of coordinates.
pub(super) fn address(
    model: &Model,
    joint: JointId,
    coordinates: usize,
) -> Result<JointAddress, SimError> {
    if model.coordinate_count(joint)? != coordinates {
        let name = model.joint_name(joint)?.unwrap_or("of an actuator");
        let reason = if coordinates == FREE {
            "is not a free joint"
        } else {
            "is neither a slide nor a hinge"
        };
        return Err(SimError::UnfitModel { object: format!("the joint {name}"), reason });
    }
    Ok(JointAddress { qpos: model.qpos_address(joint)?, dof: model.dof_address(joint)? })
}
