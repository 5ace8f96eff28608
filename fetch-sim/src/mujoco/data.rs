use std::{
    ffi::c_int,
    fmt,
    ptr::{self, NonNull},
    slice,
    sync::Arc,
};

use nalgebra::{Matrix3, Quaternion, Vector3};

use super::{
    arrays::{DataArray, quaternion, set_quaternion, set_vector, vector},
    contact_filter::ContactFilter,
    fault::find_fault,
    ffi::{self, RawData, RawFilter},
    ids::{BodyId, GeomId, SiteId},
    library::check,
    model::Model,
};
use crate::SimError;

/// The state of one simulation of a [`Model`].
///
/// Quaternions are (w, x, y, z) and need not be of unit length. Derived quantities (positions of
/// bodies and sites, contacts) are those of the last [`forward`](Self::forward), or of the
/// beginning of the last substep of a [`step`](Self::step): one substep older than `qpos`.
pub struct Data {
    model: Arc<Model>,
    raw: NonNull<RawData>,
    filter: Option<ContactFilter>,
}

// SAFETY: an mjData is plain memory that belongs to no thread, and `Data` owns it.
unsafe impl Send for Data {}
// SAFETY: every method that takes `&self` only reads the mjData.
unsafe impl Sync for Data {}

impl Data {
    /// Allocates a simulation in the model's initial state.
    ///
    /// # Errors
    /// [`SimError::Mujoco`] if there is no memory for it.
    pub fn new(model: Arc<Model>) -> Result<Self, SimError> {
        let mut raw = ptr::null_mut();
        // SAFETY: the model is alive and `raw` is valid for writes.
        let status = unsafe { ffi::fs_make_data(model.as_ptr(), &raw mut raw) };
        check(status)?;
        let raw = NonNull::new(raw)
            .ok_or_else(|| SimError::Mujoco { message: "mj_makeData returned nothing".into() })?;
        Ok(Self { model, raw, filter: None })
    }

    /// Gives the simulation a [`ContactFilter`], or takes it away. Without one, as at first, a
    /// [`step`](Self::step) is MuJoCo's own, and as slow.
    ///
    /// # Errors
    /// [`SimError::Mujoco`] if there is no memory for it.
    pub fn set_contact_filter(&mut self, filter: bool) -> Result<(), SimError> {
        self.filter = filter.then(|| ContactFilter::new(&self.model, self.raw)).transpose()?;
        Ok(())
    }

    /// The contact filter, if there is one.
    #[must_use]
    pub const fn contact_filter(&self) -> Option<&ContactFilter> {
        self.filter.as_ref()
    }

    /// The contact filter, to be checked.
    pub const fn contact_filter_mut(&mut self) -> Option<&mut ContactFilter> {
        self.filter.as_mut()
    }

    fn filter_ptr(&self) -> *mut RawFilter {
        self.filter.as_ref().map_or(ptr::null_mut(), ContactFilter::as_ptr)
    }

    /// The model that is simulated.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        &self.model
    }

    /// Back to the model's initial state (`mj_resetData`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`] with MuJoCo's message.
    pub fn reset(&mut self) -> Result<(), SimError> {
        // SAFETY: the data is alive and was made from this model.
        check(unsafe { ffi::fs_reset(self.model.as_ptr(), self.raw.as_ptr()) })
    }

    /// Computes everything that follows from positions, velocities and controls (`mj_forward`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`], [`SimError::Unstable`] or [`SimError::BufferFull`].
    pub fn forward(&mut self) -> Result<(), SimError> {
        let (model, data) = (self.model.as_ptr(), self.raw.as_ptr());
        // SAFETY: the data is alive and was made from this model; so was the filter, if any.
        check(unsafe { ffi::fs_forward(model, data, self.filter_ptr()) })?;
        self.check_stable()
    }

    /// Simulates a number of time steps (`mj_step`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`], [`SimError::Unstable`] or [`SimError::BufferFull`]; the data must then
    /// be [`reset`](Self::reset).
    pub fn step(&mut self, count: u32) -> Result<(), SimError> {
        let count = c_int::try_from(count).unwrap_or(c_int::MAX);
        let (model, data) = (self.model.as_ptr(), self.raw.as_ptr());
        // SAFETY: the data is alive and was made from this model; so was the filter, if any.
        check(unsafe { ffi::fs_step(model, data, self.filter_ptr(), count) })?;
        self.check_stable()
    }

    /// MuJoCo resets an unstable simulation and goes on: only its warning counters tell.
    fn check_stable(&self) -> Result<(), SimError> {
        // SAFETY: the data is alive, and the kinds are the shim's.
        find_fault(|kind| unsafe { ffi::fs_warning_count(self.raw.as_ptr(), kind) })
    }

    /// Simulated time, in seconds.
    #[must_use]
    pub fn time(&self) -> f64 {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_time(self.raw.as_ptr()) }
    }

    /// Sets the simulated time, in seconds.
    pub fn set_time(&mut self, time: f64) {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_set_time(self.raw.as_ptr(), time) }
    }

    /// Joint positions (`nq` numbers).
    #[must_use]
    pub fn qpos(&self) -> &[f64] {
        self.array(DataArray::Qpos)
    }

    /// Joint positions, to be changed.
    pub fn qpos_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Qpos)
    }

    /// Joint velocities (`nv` numbers).
    #[must_use]
    pub fn qvel(&self) -> &[f64] {
        self.array(DataArray::Qvel)
    }

    /// Joint velocities, to be changed.
    pub fn qvel_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Qvel)
    }

    /// Actuator controls (`nu` numbers).
    #[must_use]
    pub fn ctrl(&self) -> &[f64] {
        self.array(DataArray::Ctrl)
    }

    /// Actuator controls, to be changed.
    pub fn ctrl_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::Ctrl)
    }

    /// Accelerations from which the constraint solver starts (`nv` numbers).
    pub(super) fn qacc_warmstart(&self) -> &[f64] {
        self.array(DataArray::QaccWarmstart)
    }

    pub(super) fn qacc_warmstart_mut(&mut self) -> &mut [f64] {
        self.array_mut(DataArray::QaccWarmstart)
    }

    /// Position (meters) and orientation of a mocap body.
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

    /// Position (meters, world frame) and orientation of a body.
    #[must_use]
    pub fn body_pose(&self, body: BodyId) -> (Vector3<f64>, Quaternion<f64>) {
        (
            vector(self.array(DataArray::Xpos), body.0),
            quaternion(self.array(DataArray::Xquat), body.0),
        )
    }

    /// Overwrites a derived body pose, as it stood when a snapshot was taken.
    pub(super) fn set_body_pose(&mut self, body: BodyId, pos: Vector3<f64>, quat: Quaternion<f64>) {
        set_vector(self.array_mut(DataArray::Xpos), body.0, pos);
        set_quaternion(self.array_mut(DataArray::Xquat), body.0, quat);
    }

    /// Position of a site (meters, world frame).
    #[must_use]
    pub fn site_position(&self, site: SiteId) -> Vector3<f64> {
        vector(self.array(DataArray::SiteXpos), site.0)
    }

    /// Overwrites the derived position of a site, for a picture.
    #[cfg(feature = "render")]
    pub(super) fn set_site_position(&mut self, site: SiteId, position: Vector3<f64>) {
        set_vector(self.array_mut(DataArray::SiteXpos), site.0, position);
    }

    #[cfg(feature = "render")]
    pub(super) const fn as_ptr(&self) -> *mut RawData {
        self.raw.as_ptr()
    }

    /// Orientation of a site: columns are its axes in the world frame.
    #[must_use]
    pub fn site_rotation(&self, site: SiteId) -> Matrix3<f64> {
        Matrix3::from_row_slice(&self.array(DataArray::SiteXmat)[9 * site.0..][..9])
    }

    /// Writes a site's Jacobians, `[3][nv]` each, row by row: meters and radians per unit of
    /// velocity.
    ///
    /// # Panics
    /// If the site is of a larger model, or a slice is not of `3 * nv` numbers.
    pub fn site_jacobian(&self, site: SiteId, translation: &mut [f64], rotation: &mut [f64]) {
        let len = 3 * self.model.nv();
        assert!(site.0 < self.model.nsite(), "a site of another model");
        assert!(translation.len() == len && rotation.len() == len, "Jacobians are 3 x nv");
        // SAFETY: the data is alive and of this model, the site is one of its sites, and both
        // slices have room for 3 x nv numbers.
        unsafe {
            ffi::fs_site_jacobian(
                self.model.as_ptr(),
                self.raw.as_ptr(),
                site.0 as c_int,
                translation.as_mut_ptr(),
                rotation.as_mut_ptr(),
            );
        }
    }

    /// How many scalar constraints the solver had: of welds, joint limits, friction and contacts.
    #[must_use]
    pub fn constraint_count(&self) -> usize {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_constraint_count(self.raw.as_ptr()) }.max(0) as usize
    }

    /// The pairs of geoms in contact.
    pub fn contacts(&self) -> impl ExactSizeIterator<Item = (GeomId, GeomId)> + '_ {
        // SAFETY: the data is alive.
        let count = unsafe { ffi::fs_contact_count(self.raw.as_ptr()) };
        (0..count.max(0) as usize).map(|contact| {
            let (mut geom1, mut geom2) = (0, 0);
            // SAFETY: the data is alive and not changed while it is borrowed, so that `contact` is
            // below its number of contacts; both geoms are valid for writes.
            unsafe {
                ffi::fs_contact_geoms(
                    self.raw.as_ptr(),
                    contact as c_int,
                    &raw mut geom1,
                    &raw mut geom2,
                );
            }
            (GeomId(geom1 as usize), GeomId(geom2 as usize))
        })
    }

    fn len(&self, array: DataArray) -> usize {
        let model = &self.model;
        match array {
            DataArray::Qpos => model.nq(),
            DataArray::Qvel | DataArray::QaccWarmstart => model.nv(),
            DataArray::Ctrl => model.nu(),
            DataArray::MocapPos => 3 * model.nmocap(),
            DataArray::MocapQuat => 4 * model.nmocap(),
            DataArray::Xpos => 3 * model.nbody(),
            DataArray::Xquat => 4 * model.nbody(),
            DataArray::SiteXpos => 3 * model.nsite(),
            DataArray::SiteXmat => 9 * model.nsite(),
        }
    }

    fn array(&self, array: DataArray) -> &[f64] {
        // SAFETY: the data is alive and the field is one of the shim's.
        let first = unsafe { ffi::fs_data_field(self.raw.as_ptr(), array as c_int) };
        if first.is_null() {
            return &[]; // C may have no address for an empty array; a slice must
        }
        // SAFETY: the array has the length that the model's sizes give it (mjxmacro.h), lives as
        // long as the data, and is written to only through `&mut self`.
        unsafe { slice::from_raw_parts(first, self.len(array)) }
    }

    fn array_mut(&mut self, array: DataArray) -> &mut [f64] {
        // SAFETY: as in `array`.
        let first = unsafe { ffi::fs_data_field(self.raw.as_ptr(), array as c_int) };
        if first.is_null() {
            return &mut [];
        }
        // SAFETY: as in `array`, and `&mut self` makes this borrow the only one.
        unsafe { slice::from_raw_parts_mut(first, self.len(array)) }
    }
}

impl Drop for Data {
    fn drop(&mut self) {
        // SAFETY: `raw` is owned, and the model outlives it.
        unsafe { ffi::fs_delete_data(self.raw.as_ptr()) };
    }
}

impl fmt::Debug for Data {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Data").field("time", &self.time()).finish_non_exhaustive()
    }
}
