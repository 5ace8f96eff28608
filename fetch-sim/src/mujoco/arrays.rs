//! Access to what a simulation's data holds: time, the arrays, and the poses in them.

use std::{ffi::c_int, slice};

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::{
    data::Data,
    ffi::{self, DataArray, RawArray},
    ids::{BodyId, SiteId},
};

impl Data {
    /// Returns the simulated time, in seconds.
    #[must_use]
    pub fn time(&self) -> f64 {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_time(self.as_ptr()) }
    }

    /// Sets the simulated time, in seconds.
    pub fn set_time(&mut self, time: f64) {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_set_time(self.as_ptr(), time) }
    }

    /// Returns the joint positions (`nq` numbers).
    #[must_use]
    pub fn qpos(&self) -> &[f64] {
        self.array(DataArray::Qpos)
    }

    /// Returns the joint positions mutably.
    pub fn qpos_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Qpos)
    }

    /// Returns the joint velocities (`nv` numbers).
    #[must_use]
    pub fn qvel(&self) -> &[f64] {
        self.array(DataArray::Qvel)
    }

    /// Returns the joint velocities mutably.
    pub fn qvel_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Qvel)
    }

    /// Returns the actuator controls (`nu` numbers).
    #[must_use]
    pub fn ctrl(&self) -> &[f64] {
        self.array(DataArray::Ctrl)
    }

    /// Returns the actuator controls mutably.
    pub fn ctrl_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Ctrl)
    }

    /// Returns the accelerations from which the constraint solver starts (`nv` numbers).
    pub(super) fn qacc_warmstart(&self) -> &[f64] {
        self.array(DataArray::QaccWarmstart)
    }

    pub(super) fn qacc_warmstart_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::QaccWarmstart)
    }

    /// Returns the position (meters) and orientation of a mocap body.
    #[must_use]
    pub fn mocap_pose(&self, mocap: usize) -> (Vector3<f64>, Quaternion<f64>) {
        (
            vector(self.array(DataArray::MocapPos), mocap),
            quaternion(self.array(DataArray::MocapQuat), mocap),
        )
    }

    /// Moves a mocap body.
    pub fn set_mocap_pose(&mut self, mocap: usize, pos: Vector3<f64>, quat: Quaternion<f64>) {
        set_vector(self.array_mut(DataArray::MocapPos), mocap, pos);
        set_quaternion(self.array_mut(DataArray::MocapQuat), mocap, quat);
    }

    /// Returns the position (meters, world frame) and orientation of a body.
    #[must_use]
    pub fn body_pose(&self, body: BodyId) -> (Vector3<f64>, Quaternion<f64>) {
        (
            vector(self.array(DataArray::Xpos), body.0),
            quaternion(self.array(DataArray::Xquat), body.0),
        )
    }

    /// Overwrites a derived body pose with the one of a snapshot.
    pub(super) fn set_body_pose(&mut self, body: BodyId, pos: Vector3<f64>, quat: Quaternion<f64>) {
        set_vector(self.array_mut(DataArray::Xpos), body.0, pos);
        set_quaternion(self.array_mut(DataArray::Xquat), body.0, quat);
    }

    /// Returns the position of a site (meters, world frame).
    #[must_use]
    pub fn site_position(&self, site: SiteId) -> Vector3<f64> {
        vector(self.array(DataArray::SiteXpos), site.0)
    }

    /// Overwrites the derived position of a site, for a picture.
    #[cfg(feature = "render")]
    pub(super) fn set_site_position(&mut self, site: SiteId, position: Vector3<f64>) {
        set_vector(self.array_mut(DataArray::SiteXpos), site.0, position);
    }

    /// Returns the orientation of a site: its columns are the site's axes in the world frame.
    #[must_use]
    pub fn site_rotation(&self, site: SiteId) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.array(DataArray::SiteXmat)[9 * site.0..][..9])
    }

    /// Writes a site's Jacobians, `[3][nv]` each and row-major: meters and radians per unit of
    /// velocity.
    ///
    /// # Panics
    /// If the site belongs to a larger model, or a slice does not hold `3 * nv` numbers.
    pub fn site_jacobian(&self, site: SiteId, translation: &mut [f64], rotation: &mut [f64]) {
        let model = self.model();
        let len = 3 * model.nv();
        assert!(site.0 < model.nsite(), "a site of another model");
        assert!(translation.len() == len && rotation.len() == len, "Jacobians are 3 x nv");
        // SAFETY: the data is alive and of this model, the site is one of its sites, and both
        // slices have room for 3 x nv numbers.
        unsafe {
            ffi::fs_site_jacobian(
                model.as_ptr(),
                self.as_ptr(),
                site.0 as c_int,
                translation.as_mut_ptr(),
                rotation.as_mut_ptr(),
            );
        }
    }

    fn array(&self, array: DataArray) -> &[f64] {
        let RawArray { first, len } = self.arrays[array as usize];
        if len == 0 {
            return &[]; // an empty array may have no address in C; a slice must have one
        }
        // SAFETY: the array has this address and length as long as the data lives, and is written to
        // only through `&mut self`.
        unsafe { slice::from_raw_parts(first, len) }
    }

    fn array_mut(&mut self, array: DataArray) -> &mut [f64] {
        let RawArray { first, len } = self.arrays[array as usize];
        if len == 0 {
            return &mut [];
        }
        // SAFETY: as in `array`, and `&mut self` makes this borrow the only one.
        unsafe { slice::from_raw_parts_mut(first, len) }
    }
}

fn vector(values: &[f64], index: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&values[3 * index..][..3])
}

fn set_vector(values: &mut [f64], index: usize, value: Vector3<f64>) {
    values[3 * index..][..3].copy_from_slice(value.as_slice());
}

fn quaternion(values: &[f64], index: usize) -> Quaternion<f64> {
    let wxyz = &values[4 * index..][..4];
    Quaternion::new(wxyz[0], wxyz[1], wxyz[2], wxyz[3])
}

fn set_quaternion(values: &mut [f64], index: usize, value: Quaternion<f64>) {
    values[4 * index..][..4].copy_from_slice(&[value.w, value.i, value.j, value.k]);
}
