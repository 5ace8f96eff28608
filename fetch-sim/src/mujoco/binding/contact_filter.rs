//! The contact filter of a simulation; `shim/contact_filter.c` explains how and why it works.

use std::{ffi::c_int, sync::Arc};

use super::{
    ffi::{self, ContactFilterCounts, RawData, RawFilter},
    library::Owned,
    model::Model,
};
use crate::error::SimError;

/// Skips collision tests of geoms that provably do not touch, without changing a bit of the result.
/// Belongs to one [`Data`](crate::Data).
#[derive(Debug)]
pub struct ContactFilter {
    raw: Owned<RawFilter>,
    /// Owns the shapes that the filter reads.
    _model: Arc<Model>,
}

impl ContactFilter {
    /// The maximal number of geoms in a filtered model. The filter's tables grow with the square of
    /// their number: at the maximum they take up to 4 MB for each model and 30 MB for each
    /// simulation.
    pub const MAX_GEOMS: usize = 1024;

    pub(crate) fn new(model: &Arc<Model>, data: &Owned<RawData>) -> Result<Self, SimError> {
        // SAFETY: the shapes and the data are alive.
        let raw = unsafe { ffi::fs_make_filter(model.shapes()?.as_ptr(), data.as_ptr()) };
        // SAFETY: the filter was just made. The shapes outlive it because it holds the model that
        // owns them, and the data because it drops its filter first and lends it to nobody who could
        // take it.
        let raw = unsafe { Owned::new(raw, "the contact filter") }?;
        Ok(Self { raw, _model: Arc::clone(model) })
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
