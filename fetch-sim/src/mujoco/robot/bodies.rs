//! The named bodies of a model, and how a simulator shows and places them.

use super::observer::Frame;
use crate::error::SimError;
use crate::mujoco::binding::{
    ids::{BodyId, JointId},
    model::Model,
};

/// Coordinates of a free joint: a position and a quaternion.
pub(super) const FREE: usize = 7;

/// The named bodies of a model. They are found by comparing names, which allocates nothing.
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    named: Vec<NamedBody>,
    /// The frames of the bodies that move, except the robot's and the task's object.
    pub(super) moving: Vec<Frame>,
}

#[derive(Debug)]
pub(super) struct NamedBody {
    name: String,
    pub(super) shown: Shown,
    placed: Option<Placed>,
}

/// Where the state of a body comes from.
#[derive(Clone, Copy, Debug)]
pub(super) enum Shown {
    /// It is the task's object.
    Object,
    /// It is the one of this index that moves.
    Moving(usize),
    /// It never moves.
    Still(Frame),
    /// It is a part of the robot.
    Robot,
}

/// How a body is placed.
#[derive(Clone, Copy, Debug)]
pub(super) enum Placed {
    /// By a free joint with these addresses in `qpos` and `qvel`.
    Joint { qpos: usize, dof: usize },
    /// By the mocap pose of this index.
    Mocap(usize),
}

impl Bodies {
    /// Finds the bodies of a model, given those of the robot's gripper and its mocap body, and the
    /// joint of the task's object.
    pub(super) fn resolve(
        model: &Model,
        gripper_link: BodyId,
        mocap: BodyId,
        object: Option<JointId>,
    ) -> Result<Self, SimError> {
        let mut robot = gripper_link;
        while model.parent(robot)? != BodyId::WORLD {
            robot = model.parent(robot)?;
        }
        let mut bodies = Self::default();
        for body in (0..model.nbody()).map(BodyId) {
            let joint = model.first_joint(body)?;
            let is_object = joint.is_some() && joint == object;
            let Some(name) = model.body_name(body)?.or(is_object.then_some("object0")) else {
                continue;
            };
            let shown = if is_object {
                Shown::Object
            } else if body == mocap || model.is_within(body, robot)? {
                Shown::Robot
            } else {
                let site = model.site(name).ok();
                let site = site.filter(|&site| model.site_body(site) == Ok(body));
                let frame = site.map_or(Frame::Body(body), Frame::Site);
                if moves(model, body)? {
                    bodies.moving.push(frame);
                    Shown::Moving(bodies.moving.len() - 1)
                } else {
                    Shown::Still(frame)
                }
            };
            let is_robot = matches!(shown, Shown::Robot);
            let placed = if is_robot { None } else { placing(model, body)? };
            bodies.named.push(NamedBody { name: name.into(), shown, placed });
        }
        Ok(bodies)
    }

    /// Iterates over the names of the bodies that are no part of the robot.
    pub(super) fn objects(&self) -> impl Iterator<Item = &str> {
        let objects = self.named.iter().filter(|body| !matches!(body.shown, Shown::Robot));
        objects.map(|body| &*body.name)
    }

    /// Returns a body.
    pub(super) fn get(&self, name: &str) -> Result<&NamedBody, SimError> {
        let body = self.named.iter().find(|body| body.name == name);
        body.ok_or_else(|| SimError::MissingName { kind: "body", name: name.into() })
    }

    /// Returns the task's object; `None` if the task has none.
    pub(super) fn object(&self) -> Option<&NamedBody> {
        self.named.iter().find(|body| matches!(body.shown, Shown::Object))
    }
}

impl NamedBody {
    /// Returns how the body is placed.
    pub(super) fn placed(&self) -> Result<Placed, SimError> {
        self.placed.ok_or_else(|| {
            self.unfit(match self.shown {
                Shown::Robot => "is a part of the robot, which only steps and resets move",
                _ => "cannot be placed: give it a free joint, or make it a mocap body",
            })
        })
    }

    /// Returns the error of a body that cannot be used, with the reason.
    pub(super) fn unfit(&self, reason: &'static str) -> SimError {
        SimError::UnfitBody { body: self.name.clone(), reason }
    }
}

/// Returns whether a body can move: it or a body that carries it has a joint or is a mocap body.
fn moves(model: &Model, mut body: BodyId) -> Result<bool, SimError> {
    while body != BodyId::WORLD {
        if model.first_joint(body)?.is_some() || model.mocap_index(body)?.is_some() {
            return Ok(true);
        }
        body = model.parent(body)?;
    }
    Ok(false)
}

fn placing(model: &Model, body: BodyId) -> Result<Option<Placed>, SimError> {
    if let Some(index) = model.mocap_index(body)? {
        return Ok(Some(Placed::Mocap(index)));
    }
    let Some(joint) = model.first_joint(body)? else { return Ok(None) };
    let (qpos, dof) = (model.qpos_address(joint)?, model.dof_address(joint)?);
    Ok((model.coordinate_count(joint)? == FREE).then_some(Placed::Joint { qpos, dof }))
}
