//! The poses of a simulation's bodies and sites, and their Jacobians.

use std::ffi::c_int;

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::{
    data::Data,
    ffi::{self, DataArray},
    ids::{BodyId, SiteId},
    library::check,
};
use crate::{bounds::check_inside, error::SimError};

/// A position (meters) and an orientation (w, x, y, z), in the world frame.
pub type Pose = (Vector3<f64>, Quaternion<f64>);

impl Data {
    /// Returns the position (meters, world frame) and orientation of a mocap body.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn mocap_pose(&self, mocap: usize) -> Result<Pose, SimError> {
        self.pose(DataArray::MocapPos, DataArray::MocapQuat, mocap)
    }

    /// Moves a mocap body.
    ///
    /// # Errors
    /// [`SimError::UnknownId`] or [`SimError::OutOfRange`]; the body then stays where it is.
    pub fn set_mocap_pose(
        &mut self,
        mocap: usize,
        pos: Vector3<f64>,
        quat: Quaternion<f64>,
    ) -> Result<(), SimError> {
        check_inside("the pose of a mocap body", pos.iter().chain(&quat.coords))?;
        self.set_pose(DataArray::MocapPos, DataArray::MocapQuat, mocap, (pos, quat))
    }

    /// Returns the position (meters, world frame) and orientation of a body.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn body_pose(&self, body: BodyId) -> Result<Pose, SimError> {
        self.pose(DataArray::Xpos, DataArray::Xquat, body.0)
    }

    /// Overwrites a derived body pose with the one of a snapshot.
    pub(crate) fn set_body_pose(&mut self, body: BodyId, pose: Pose) -> Result<(), SimError> {
        self.set_pose(DataArray::Xpos, DataArray::Xquat, body.0, pose)
    }

    /// Returns the orientation of a body: its columns are the body's axes in the world frame.
    pub(crate) fn body_rotation(&self, body: BodyId) -> Result<Matrix3<f64>, SimError> {
        let rows: &[f64; 9] = self.item(DataArray::Xmat, body.0)?;
        Ok(Matrix3::from_row_slice(rows))
    }

    /// Returns the position of a site (meters, world frame).
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn site_position(&self, site: SiteId) -> Result<Vector3<f64>, SimError> {
        self.item(DataArray::SiteXpos, site.0).copied().map(Vector3::from)
    }

    /// Overwrites the derived position of a site, for a picture.
    #[cfg(feature = "render")]
    pub(crate) fn set_site_position(
        &mut self,
        site: SiteId,
        position: Vector3<f64>,
    ) -> Result<(), SimError> {
        *self.item_mut(DataArray::SiteXpos, site.0)? = position.into();
        Ok(())
    }

    /// Returns the orientation of a site: its columns are the site's axes in the world frame.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn site_rotation(&self, site: SiteId) -> Result<Matrix3<f64>, SimError> {
        let rows: &[f64; 9] = self.item(DataArray::SiteXmat, site.0)?;
        Ok(Matrix3::from_row_slice(rows))
    }

    /// Writes a site's Jacobians, `[3][nv]` each and row-major: meters and radians per unit of
    /// velocity.
    ///
    /// # Errors
    /// [`SimError::UnknownId`], [`SimError::WrongLength`] if a slice does not hold `3 * nv`
    /// numbers, or [`SimError::Mujoco`].
    pub fn site_jacobian(
        &self,
        site: SiteId,
        translation: &mut [f64],
        rotation: &mut [f64],
    ) -> Result<(), SimError> {
        self.check_jacobians([translation, rotation])?;
        self.site_position(site)?;
        // SAFETY: the data is alive and of this model, the site is one of its sites, and both
        // slices have room for 3 x nv numbers.
        check(unsafe {
            ffi::fs_site_jacobian(
                self.simulated(),
                self.as_ptr(),
                site.0 as c_int,
                translation.as_mut_ptr(),
                rotation.as_mut_ptr(),
            )
        })
    }

    /// Writes the Jacobians of a body's frame, as [`site_jacobian`](Self::site_jacobian) writes a
    /// site's.
    pub(crate) fn body_jacobian(
        &self,
        body: BodyId,
        translation: &mut [f64],
        rotation: &mut [f64],
    ) -> Result<(), SimError> {
        self.check_jacobians([translation, rotation])?;
        self.body_pose(body)?;
        // SAFETY: the data is alive and of this model, the body is one of its bodies, and both
        // slices have room for 3 x nv numbers.
        check(unsafe {
            ffi::fs_body_jacobian(
                self.simulated(),
                self.as_ptr(),
                body.0 as c_int,
                translation.as_mut_ptr(),
                rotation.as_mut_ptr(),
            )
        })
    }

    fn check_jacobians(&self, jacobians: [&[f64]; 2]) -> Result<(), SimError> {
        let (what, expected) = ("a Jacobian", 3 * self.model().nv());
        let mut lengths = jacobians.into_iter().map(<[f64]>::len);
        let wrong = lengths.find(|&actual| actual != expected);
        wrong.map_or(Ok(()), |actual| Err(SimError::WrongLength { what, expected, actual }))
    }

    fn pose(
        &self,
        positions: DataArray,
        orientations: DataArray,
        id: usize,
    ) -> Result<Pose, SimError> {
        let &[w, x, y, z] = self.item(orientations, id)?;
        Ok((Vector3::from(*self.item(positions, id)?), Quaternion::new(w, x, y, z)))
    }

    fn set_pose(
        &mut self,
        positions: DataArray,
        orientations: DataArray,
        id: usize,
        (position, q): Pose,
    ) -> Result<(), SimError> {
        *self.item_mut(positions, id)? = position.into();
        *self.item_mut(orientations, id)? = [q.w, q.i, q.j, q.k];
        Ok(())
    }

    /// Returns the numbers of an object in an array that has `N` for each object of its kind.
    fn item<const N: usize>(&self, array: DataArray, id: usize) -> Result<&[f64; N], SimError> {
        let (items, _) = self.array(array).as_chunks();
        items.get(id).ok_or_else(|| unknown(array, id, items.len()))
    }

    fn item_mut<const N: usize>(
        &mut self,
        array: DataArray,
        id: usize,
    ) -> Result<&mut [f64; N], SimError> {
        let (items, _) = self.array_mut(array).as_chunks_mut();
        let count = items.len();
        items.get_mut(id).ok_or_else(|| unknown(array, id, count))
    }
}

fn unknown(array: DataArray, id: usize, count: usize) -> SimError {
    let kind = match array {
        DataArray::MocapPos | DataArray::MocapQuat => "mocap body",
        DataArray::SiteXpos | DataArray::SiteXmat => "site",
        _ => "body",
    };
    SimError::UnknownId { kind, id, count }
}
