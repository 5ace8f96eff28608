use std::{ffi::c_int, ptr::NonNull, sync::Arc};

use super::{
    ffi::{self, RawData, RawFilter, RawShapes},
    model::Model,
};
use crate::SimError;

/// Leaves out collision tests of geoms that provably do not touch, without changing a bit of the
/// result. Belongs to one [`Data`](super::Data); see `shim/contact_filter.c` for how and why.
#[derive(Debug)]
pub struct ContactFilter {
    raw: NonNull<RawFilter>,
    /// Owns the shapes that the filter looks at.
    _model: Arc<Model>,
}

// SAFETY: a filter is plain memory that belongs to no thread, and `ContactFilter` owns it.
unsafe impl Send for ContactFilter {}
// SAFETY: every method that takes `&self` only reads it.
unsafe impl Sync for ContactFilter {}

/// What a [`ContactFilter`] has done so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
#[non_exhaustive]
pub struct ContactFilterCounts {
    /// Pairs of geoms that MuJoCo was about to test.
    pub pairs: u64,
    /// Those of them that the filter rejected.
    pub rejected: u64,
    /// Rejections that were checked.
    pub checked: u64,
    /// Rejections that MuJoCo contradicted: always 0, or the filter is wrong.
    pub refuted: u64,
}

impl ContactFilter {
    pub(super) fn new(model: &Arc<Model>, data: NonNull<RawData>) -> Result<Self, SimError> {
        let shapes = model.shapes()?;
        // SAFETY: the shapes are alive, and stay so as the filter holds the model that owns them.
        let raw = unsafe { ffi::fs_make_filter(shapes.0.as_ptr(), data.as_ptr()) };
        let raw = NonNull::new(raw).ok_or_else(no_memory)?;
        Ok(Self { raw, _model: Arc::clone(model) })
    }

    pub(super) const fn as_ptr(&self) -> *mut RawFilter {
        self.raw.as_ptr()
    }

    /// What it has done so far.
    #[must_use]
    pub fn counts(&self) -> ContactFilterCounts {
        let mut counts = ContactFilterCounts::default();
        // SAFETY: the filter is alive and `counts`, laid out as in C, is valid for writes.
        unsafe { ffi::fs_get_filter_counts(self.raw.as_ptr(), &raw mut counts) };
        counts
    }

    /// Whether to check every rejection from now on: MuJoCo's own routine is run with a margin as
    /// wide as the filter believes the gap to be, and must find nothing. Slower than no filter.
    pub fn check_rejections(&mut self, check: bool) {
        // SAFETY: the filter is alive and borrowed alone.
        unsafe { ffi::fs_check_filter(self.raw.as_ptr(), c_int::from(check)) };
    }
}

impl Drop for ContactFilter {
    fn drop(&mut self) {
        // SAFETY: `raw` is owned, and in use only during a call that borrows it.
        unsafe { ffi::fs_delete_filter(self.raw.as_ptr()) };
    }
}

/// The shapes of a model's geoms, prepared for its filters.
#[derive(Debug)]
pub(super) struct Shapes(NonNull<RawShapes>);

// SAFETY: plain memory that belongs to no thread, is owned, and does not change.
unsafe impl Send for Shapes {}
// SAFETY: as above.
unsafe impl Sync for Shapes {}

impl Shapes {
    /// # Safety
    /// The model must be alive, and outlive every use of the shapes but their end.
    pub(super) unsafe fn new(model: *const ffi::RawModel) -> Result<Self, SimError> {
        // SAFETY: promised by the caller.
        let raw = unsafe { ffi::fs_make_shapes(model) };
        NonNull::new(raw).map(Self).ok_or_else(no_memory)
    }
}

impl Drop for Shapes {
    fn drop(&mut self) {
        // SAFETY: owned, and every filter that uses it holds the model that holds it.
        unsafe { ffi::fs_delete_shapes(self.0.as_ptr()) };
    }
}

fn no_memory() -> SimError {
    SimError::Mujoco { message: "no memory for the contact filter".into() }
}
