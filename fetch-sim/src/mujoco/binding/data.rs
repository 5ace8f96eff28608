//! One simulation of a model: its steps, their errors, and its arrays.

use std::{ffi::c_int, fmt, ptr, slice, sync::Arc};

use super::{
    contact_filter::ContactFilter,
    ffi::{self, DataArray, DataArrays, Fault, RawArray, RawData, RawFilter, RawModel},
    ids::GeomId,
    library::{Owned, check},
    model::Model,
    varied_model::VariedModel,
};
use crate::bounds::check_inside;
use crate::error::SimError;
use crate::memory::check_memory;

/// What the process can still get beside a simulation, in bytes: more than the small things around
/// it take. It is also more than the largest block (32 MiB) whose release makes glibc serve the later
/// ones from its heap.
const SPARE: usize = 33 << 20;

/// The state of one simulation of a [`Model`].
///
/// Quaternions are (w, x, y, z) and need not be of unit length. Derived quantities (positions of
/// bodies and sites, contacts) are those of the last [`forward`](Self::forward), or of the
/// beginning of the last substep of a [`step`](Self::step): one substep older than `qpos`.
pub struct Data {
    // Fields are dropped in this order: each before those that it uses.
    filter: Option<ContactFilter>,
    raw: Owned<RawData>,
    arrays: DataArrays,
    /// What is simulated instead of the model, if its numbers have been changed.
    varied: Option<VariedModel>,
    model: Arc<Model>,
}

// SAFETY: an mjData is plain memory that belongs to no thread, and `Data` owns it.
unsafe impl Send for Data {}
// SAFETY: every method that takes `&self` only reads the mjData.
unsafe impl Sync for Data {}

impl Data {
    /// Allocates a simulation in the model's initial state.
    ///
    /// # Errors
    /// [`SimError::NoMemory`].
    pub fn new(model: Arc<Model>) -> Result<Self, SimError> {
        let mut raw = ptr::null_mut();
        // SAFETY: the model is alive and `raw` is valid for writes.
        let status = unsafe { ffi::fs_make_data(model.as_ptr(), &raw mut raw) };
        check(status)?;
        // SAFETY: MuJoCo just made this data for the caller, which drops it before the model.
        let raw = unsafe { Owned::new(raw, "the simulation's data") }?;
        check_memory(SPARE, "a simulation")?;
        let mut arrays = DataArrays::default();
        // SAFETY: the data is alive and was made from this model; `arrays` is valid for writes.
        unsafe { ffi::fs_data_arrays(model.as_ptr(), raw.as_ptr(), &raw mut arrays) };
        Ok(Self { filter: None, raw, arrays, varied: None, model })
    }

    /// Adds a [`ContactFilter`] to the simulation, or removes it. New data has none, so a
    /// [`step`](Self::step) is exactly MuJoCo's own, and as slow. A model of more than
    /// [`ContactFilter::MAX_GEOMS`] geoms gets none.
    ///
    /// # Errors
    /// [`SimError::NoMemory`].
    pub fn set_contact_filter(&mut self, filter: bool) -> Result<(), SimError> {
        let filter = filter && self.model.ngeom() <= ContactFilter::MAX_GEOMS;
        self.filter = None;
        if filter {
            let shapes = match &mut self.varied {
                Some(varied) => varied.shapes()?,
                None => self.model.shapes()?,
            };
            // SAFETY: this owns the data and what owns the shapes, drops its filter before them, and
            // lends it to nobody who could take it.
            self.filter = Some(unsafe { ContactFilter::new(shapes, &self.raw) }?);
        }
        Ok(())
    }

    /// Returns the contact filter, if there is one.
    #[must_use]
    pub const fn contact_filter(&self) -> Option<&ContactFilter> {
        self.filter.as_ref()
    }

    /// Sets whether the contact filter, if there is one, checks every rejection from now on:
    /// MuJoCo's own routine, called with a margin as wide as the assumed gap, must find nothing.
    /// Slower than no filter; off by default.
    pub fn check_rejections(&mut self, check: bool) {
        if let Some(filter) = &mut self.filter {
            filter.check_rejections(check);
        }
    }

    fn filter_ptr(&self) -> *mut RawFilter {
        self.filter.as_ref().map_or(ptr::null_mut(), ContactFilter::as_ptr)
    }

    /// Changes numbers of the model, for this simulation alone, which must then be
    /// [`reset`](Self::reset). The first call copies the model.
    pub(crate) fn vary(&mut self, change: impl FnOnce(&mut VariedModel)) -> Result<(), SimError> {
        let varied = match self.varied.take() {
            Some(varied) => varied,
            None => VariedModel::new(&self.model)?,
        };
        let varied = self.varied.insert(varied);
        if let Some(filter) = &mut self.filter {
            varied.shapes()?;
            change(varied);
            // SAFETY: this owns the shapes' owner, and drops its filter first; they are a copy of the
            // model's.
            unsafe { filter.set_shapes(varied.shapes()?) };
        } else {
            change(varied);
        }
        Ok(())
    }

    /// Returns what is simulated: the model, or this simulation's copy of it.
    pub(super) fn simulated(&self) -> *const RawModel {
        self.varied.as_ref().map_or_else(|| self.model.as_ptr(), VariedModel::as_ptr)
    }

    /// Returns the simulated model, without the numbers that vary.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        &self.model
    }

    pub(crate) const fn as_ptr(&self) -> *mut RawData {
        self.raw.as_ptr()
    }

    /// Returns to the model's initial state (`mj_resetData`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`] with MuJoCo's message.
    pub fn reset(&mut self) -> Result<(), SimError> {
        // SAFETY: the data is alive and was made from this model, or the model that it is a copy of.
        check(unsafe { ffi::fs_reset(self.simulated(), self.raw.as_ptr()) })
    }

    /// Computes everything that follows from positions, velocities and controls (`mj_forward`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`], [`SimError::Unstable`] or [`SimError::BufferFull`].
    pub fn forward(&mut self) -> Result<(), SimError> {
        let (model, data) = (self.simulated(), self.raw.as_ptr());
        // SAFETY: the data is alive and was made from this model; so was the filter, if any.
        check(unsafe { ffi::fs_forward(model, data, self.filter_ptr()) })?;
        self.check_faults()
    }

    /// Simulates a number of time steps (`mj_step`).
    ///
    /// # Errors
    /// [`SimError::Mujoco`], [`SimError::Unstable`] or [`SimError::BufferFull`]; the data must then
    /// be [`reset`](Self::reset).
    pub fn step(&mut self, count: u32) -> Result<(), SimError> {
        let count = c_int::try_from(count).unwrap_or(c_int::MAX);
        let (model, data) = (self.simulated(), self.raw.as_ptr());
        // SAFETY: the data is alive and was made from this model; so was the filter, if any.
        check(unsafe { ffi::fs_step(model, data, self.filter_ptr(), count) })?;
        self.check_faults()
    }

    /// Returns an error for the first fault that MuJoCo counted: it resets an unstable simulation
    /// and continues, and only the counters of its warnings show that.
    fn check_faults(&self) -> Result<(), SimError> {
        // SAFETY: the data is alive, and the faults are the shim's.
        let count = |fault| unsafe { ffi::fs_fault_count(self.raw.as_ptr(), fault as c_int) };
        match FAULTS.into_iter().find(|&(fault, _)| count(fault) > 0) {
            None => Ok(()),
            Some((Fault::ContactsFull | Fault::ConstraintsFull, reason)) => {
                Err(SimError::BufferFull { reason: reason.into() })
            }
            Some((_, reason)) => Err(SimError::Unstable { reason: reason.into() }),
        }
    }

    /// Returns the pairs of geoms in contact. Contacts of a flex, which has no geoms, are left out.
    pub fn contacts(&self) -> impl Iterator<Item = (GeomId, GeomId)> + '_ {
        // SAFETY: the data is alive.
        let count = unsafe { ffi::fs_contact_count(self.raw.as_ptr()) };
        (0..count).filter_map(|contact| {
            let mut geoms = [0; 2];
            // SAFETY: the data is alive and does not change while it is borrowed, so that `contact`
            // is below its number of contacts; `geoms` is valid for writes.
            unsafe { ffi::fs_contact_geoms(self.raw.as_ptr(), contact, &raw mut geoms) };
            let [first, second] = geoms.map(|geom| usize::try_from(geom).ok().map(GeomId));
            first.zip(second)
        })
    }

    /// Returns the simulated time, in seconds.
    #[must_use]
    pub fn time(&self) -> f64 {
        // SAFETY: the data is alive.
        unsafe { ffi::fs_time(self.as_ptr()) }
    }

    /// Sets the simulated time, in seconds.
    ///
    /// # Errors
    /// [`SimError::OutOfRange`]; the time then stays the same.
    pub fn set_time(&mut self, time: f64) -> Result<(), SimError> {
        check_inside("the time", &[time])?;
        // SAFETY: the data is alive.
        unsafe { ffi::fs_set_time(self.as_ptr(), time) }
        Ok(())
    }

    pub(crate) fn array(&self, array: DataArray) -> &[f64] {
        let RawArray { first, len } = self.arrays[array as usize];
        if len == 0 {
            return &[]; // an empty array may have no address in C; a slice must have one
        }
        // SAFETY: the array has this address and length as long as the data lives, and is written
        // to only through `&mut self`.
        unsafe { slice::from_raw_parts(first, len) }
    }

    pub(crate) fn array_mut(&mut self, array: DataArray) -> &mut [f64] {
        let RawArray { first, len } = self.arrays[array as usize];
        if len == 0 {
            return &mut [];
        }
        // SAFETY: as in `array`, and `&mut self` makes this borrow the only one.
        unsafe { slice::from_raw_parts_mut(first, len) }
    }
}

/// Declares the methods that return an array of a simulation, shared and mutable.
macro_rules! arrays {
    ($($visibility:vis $name:ident, $name_mut:ident: $array:ident, $what:literal;)*) => {
        impl Data {$(
            #[doc = concat!("Returns the ", $what, ".")]
            #[must_use]
            $visibility fn $name(&self) -> &[f64] {
                self.array(DataArray::$array)
            }

            #[doc = concat!("Returns the ", $what, ", mutably.")]
            $visibility fn $name_mut(&mut self) -> &mut [f64] {
                self.array_mut(DataArray::$array)
            }
        )*}
    };
}

arrays! {
    pub qpos, qpos_mut: Qpos, "joint positions (`nq` numbers)";
    pub qvel, qvel_mut: Qvel, "joint velocities (`nv` numbers)";
    pub ctrl, ctrl_mut: Ctrl, "actuator controls (`nu` numbers)";
    pub(crate) act, act_mut: Act, "activations of actuators (`na` numbers)";
    pub(crate) qacc_warmstart, qacc_warmstart_mut: QaccWarmstart,
        "accelerations from which the constraint solver starts (`nv` numbers)";
}

const FAULTS: [(Fault, &str); 7] = [
    (Fault::BadInertia, "the inertia matrix is singular"),
    (Fault::ContactsFull, "the contact buffer is full"),
    (Fault::ConstraintsFull, "the constraint buffer is full"),
    (Fault::BadQpos, "a position is huge or not finite"),
    (Fault::BadQvel, "a velocity is huge or not finite"),
    (Fault::BadQacc, "an acceleration is huge or not finite"),
    (Fault::BadCtrl, "a control is huge or not finite"),
];

impl fmt::Debug for Data {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Data").field("time", &self.time()).finish_non_exhaustive()
    }
}
