//! The contact filter of a simulation; `shim/contact_filter.c` explains how and why it works.

use std::ffi::c_int;

use super::{
    ffi::{self, ContactFilterCounts, RawData, RawFilter, RawShapes},
    library::Owned,
};
use crate::error::SimError;

/// Skips collision tests of geoms that provably do not touch, without changing a bit of the result.
/// Belongs to one [`Data`](crate::Data).
#[derive(Debug)]
pub struct ContactFilter {
    raw: Owned<RawFilter>,
}

impl ContactFilter {
    /// The maximal number of geoms in a filtered model. The filter's tables grow with the square of
    /// their number: at the maximum they take up to 4 MB for each model and 30 MB for each
    /// simulation.
    pub const MAX_GEOMS: usize = 1024;

    /// Creates the filter of a simulation.
    ///
    /// # Safety
    /// The shapes and the data outlive the filter.
    pub(super) unsafe fn new(
        shapes: &Owned<RawShapes>,
        data: &Owned<RawData>,
    ) -> Result<Self, SimError> {
        // SAFETY: the shapes and the data are alive.
        let raw = unsafe { ffi::fs_make_filter(shapes.as_ptr(), data.as_ptr()) };
        // SAFETY: the filter was just made, and the caller keeps alive what it uses.
        Ok(Self { raw: unsafe { Owned::new(raw, "the contact filter") }? })
    }

    /// Takes shapes of other sizes for the same geoms.
    ///
    /// # Safety
    /// The shapes outlive the filter, and are those of a copy of its model.
    pub(super) unsafe fn set_shapes(&mut self, shapes: &Owned<RawShapes>) {
        // SAFETY: both are alive, and the caller keeps the shapes so.
        unsafe { ffi::fs_set_filter_shapes(self.raw.as_ptr(), shapes.as_ptr()) };
    }

    pub(crate) const fn as_ptr(&self) -> *mut RawFilter {
        self.raw.as_ptr()
    }

    /// Returns the filter's counts so far.
    #[must_use]
    pub fn counts(&self) -> ContactFilterCounts {
        let mut counts = ContactFilterCounts::default();
        // SAFETY: the filter is alive and `counts` is valid for writes.
        unsafe { ffi::fs_get_filter_counts(self.raw.as_ptr(), &raw mut counts) };
        counts
    }

    /// Sets whether to check every rejection from now on.
    pub(super) fn check_rejections(&mut self, check: bool) {
        // SAFETY: the filter is alive and borrowed mutably.
        unsafe { ffi::fs_check_filter(self.raw.as_ptr(), c_int::from(check)) };
    }
}
