//! A copy of a model, for one simulation, whose numbers may change.

use std::{ffi::c_int, ptr, slice, sync::Arc};

use super::{
    ffi::{self, PhysicsArray, PhysicsArrays, RawArray, RawModel, RawShapes},
    library::{Owned, check},
    model::Model,
};
use crate::error::SimError;

/// A copy of a model that belongs to one [`Data`](crate::Data), so that its numbers may change
/// between steps while all others go on sharing the model.
pub(crate) struct VariedModel {
    /// The shapes for contact filters, made on the first call; dropped before the models.
    shapes: Option<Owned<RawShapes>>,
    raw: Owned<RawModel>,
    arrays: PhysicsArrays,
    /// Owns the tables that the shapes share with its own.
    base: Arc<Model>,
}

impl VariedModel {
    /// Copies a model.
    pub(super) fn new(base: &Arc<Model>) -> Result<Self, SimError> {
        let mut raw = ptr::null_mut();
        // SAFETY: the model is alive, and `raw` is valid for writes.
        check(unsafe { ffi::fs_copy_model(base.as_ptr(), &raw mut raw) })?;
        // SAFETY: MuJoCo just made this model for the caller, and the data that uses it drops it last.
        let raw = unsafe { Owned::new(raw, "a copy of the model") }?;
        let mut arrays = PhysicsArrays::default();
        // SAFETY: the model is alive, and `arrays` is valid for writes.
        unsafe { ffi::fs_physics_arrays(raw.as_ptr(), &raw mut arrays) };
        Ok(Self { shapes: None, raw, arrays, base: Arc::clone(base) })
    }

    pub(super) const fn as_ptr(&self) -> *const RawModel {
        self.raw.as_ptr()
    }

    /// Returns the shapes of the geoms, copied from the model's on the first call.
    pub(super) fn shapes(&mut self) -> Result<&Owned<RawShapes>, SimError> {
        let shapes = match self.shapes.take() {
            Some(shapes) => shapes,
            None => {
                // SAFETY: the model's shapes are alive.
                let shapes = unsafe { ffi::fs_copy_shapes(self.base.shapes()?.as_ptr()) };
                // SAFETY: the shapes were just made; the models that they use are dropped later.
                unsafe { Owned::new(shapes, "the contact filter") }?
            }
        };
        Ok(self.shapes.insert(shapes))
    }

    /// Returns numbers of the model that was copied.
    pub(crate) fn base(&self, array: PhysicsArray) -> &[f64] {
        self.base.physics(array)
    }

    /// Returns numbers, to change them.
    pub(crate) fn array_mut(&mut self, array: PhysicsArray) -> &mut [f64] {
        let RawArray { first, len } = self.arrays[array as usize];
        if len == 0 {
            return &mut [];
        }
        // SAFETY: the array has this address and length as long as the model lives, which belongs to
        // one simulation; `&mut self` makes this borrow the only one.
        unsafe { slice::from_raw_parts_mut(first, len) }
    }

    /// Computes the bounds of a geom again whose sizes have changed.
    pub(crate) fn resize_shape(&mut self, geom: usize) {
        if let Some(shapes) = &self.shapes {
            // SAFETY: both are alive, the shapes are a copy that belongs to this model, and the geom is
            // one of its geoms.
            unsafe { ffi::fs_resize_shape(shapes.as_ptr(), self.as_ptr(), geom as c_int) };
        }
    }
}
