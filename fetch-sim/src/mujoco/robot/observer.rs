//! The states of bodies and sites that a simulator shows.

use nalgebra::Vector3;

use crate::mujoco::binding::{
    data::Data,
    ids::{BodyId, SiteId},
};
use crate::{error::SimError, simulator::ObjectState};

/// The frame whose state is shown.
#[derive(Clone, Copy, Debug)]
pub(super) enum Frame {
    Site(SiteId),
    Body(BodyId),
}

/// A computation of states, in its own memory.
#[derive(Debug)]
pub(super) struct Observer {
    /// Room for the Jacobians of one frame, `[3][nv]` each.
    translation: Vec<f64>,
    rotation: Vec<f64>,
}

impl Observer {
    /// Creates an observer of simulations with `nv` degrees of freedom.
    pub(super) fn new(nv: usize) -> Self {
        Self { translation: vec![0.0; 3 * nv], rotation: vec![0.0; 3 * nv] }
    }

    /// Returns the pose and the velocities of a frame.
    pub(super) fn state(&mut self, data: &Data, frame: Frame) -> Result<ObjectState, SimError> {
        let (linear_velocity, angular_velocity) = self.velocity(data, frame)?;
        Ok(ObjectState { linear_velocity, angular_velocity, ..still_state(data, frame)? })
    }

    /// Returns the linear and angular velocity of a frame: its Jacobians, as old as its position,
    /// times `qvel`.
    pub(super) fn velocity(
        &mut self,
        data: &Data,
        frame: Frame,
    ) -> Result<(Vector3<f64>, Vector3<f64>), SimError> {
        let Self { translation, rotation } = self;
        match frame {
            Frame::Site(site) => data.site_jacobian(site, translation, rotation)?,
            Frame::Body(body) => data.body_jacobian(body, translation, rotation)?,
        }
        let qvel = data.qvel();
        let times_qvel = |jacobian: &[f64]| {
            Vector3::from_iterator(
                jacobian
                    .chunks_exact(qvel.len())
                    .map(|row| row.iter().zip(qvel).map(|(j, v)| j * v).sum()),
            )
        };
        Ok((times_qvel(translation), times_qvel(rotation)))
    }
}

/// Returns the pose of a frame, and velocities of zero.
pub(super) fn still_state(data: &Data, frame: Frame) -> Result<ObjectState, SimError> {
    let (position, rotation) = match frame {
        Frame::Site(site) => (data.site_position(site)?, data.site_rotation(site)?),
        Frame::Body(body) => (data.body_pose(body)?.0, data.body_rotation(body)?),
    };
    let zero = Vector3::zeros();
    Ok(ObjectState { position, rotation, linear_velocity: zero, angular_velocity: zero })
}
