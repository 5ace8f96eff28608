//! A compiled model: loading, sizes, and the changes made before it is shared.

use std::{
    ffi::{CString, c_int},
    fmt,
    path::Path,
    ptr,
    sync::OnceLock,
};

use super::{
    ffi::{self, RawModel, RawShapes, Sizes},
    library::{Owned, check_as, load_once},
};
use crate::error::SimError;

/// A compiled MuJoCo model.
///
/// A model does not change once it is shared: any number of [`Data`](super::Data), on any number of
/// threads, simulate the same model through an `Arc`.
pub struct Model {
    /// The geoms' shapes, prepared for contact filters; dropped before the model that they use.
    shapes: OnceLock<Result<Owned<RawShapes>, SimError>>,
    raw: Owned<RawModel>,
    pub(super) sizes: Sizes,
}

/// Declares the methods that return a model's counts.
macro_rules! counts {
    ($($count:ident: $objects:literal,)*) => {
        impl Model {$(
            #[doc = concat!("Returns the number of ", $objects, ".")]
            #[must_use]
            pub const fn $count(&self) -> usize {
                self.sizes.$count as usize
            }
        )*}
    };
}

counts! {
    nq: "position coordinates",
    nv: "degrees of freedom",
    nu: "actuators",
    nbody: "bodies, including the world",
    ngeom: "geoms",
    nsite: "sites",
    nmocap: "mocap bodies",
}

impl Model {
    /// Compiles an MJCF file, including the files that it names.
    ///
    /// # Errors
    /// [`SimError::Model`] with MuJoCo's message if the file cannot be read or compiled;
    /// [`SimError::Library`], [`SimError::BuiltWithoutMujoco`] or [`SimError::ShimMismatch`] if MuJoCo
    /// cannot be used.
    pub fn from_path(path: &Path) -> Result<Self, SimError> {
        load_once()?;
        let name = path.display().to_string();
        let c_path = c_string(&name, &name)?;
        let mut raw = ptr::null_mut();
        // SAFETY: the library is loaded, `c_path` is a C string and `raw` is valid for writes.
        let status = unsafe { ffi::fs_load_path(c_path.as_ptr(), &raw mut raw) };
        Self::from_raw(raw, status, &name)
    }

    /// Compiles MJCF held in memory: pairs of file name and contents.
    ///
    /// The first file is the model; it may include the others by name.
    ///
    /// # Errors
    /// As [`from_path`](Self::from_path).
    pub fn from_files(files: &[(&str, &str)]) -> Result<Self, SimError> {
        load_once()?;
        let &[(main, _), ..] = files else {
            return Err(SimError::Model { name: String::new(), reason: "no file given".into() });
        };
        let names = files
            .iter()
            .map(|(name, _)| c_string(name, main))
            .collect::<Result<Vec<CString>, SimError>>()?;
        let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
        let bytes: Vec<_> = files.iter().map(|(_, text)| text.as_ptr()).collect();
        let sizes = files
            .iter()
            .map(|(_, text)| c_int::try_from(text.len()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| model_error(main, error))?;
        let mut raw = ptr::null_mut();
        // SAFETY: the library is loaded; the three arrays have one valid entry for each file during
        // the call, which copies the contents; there are far fewer than 2^31 files.
        let status = unsafe {
            ffi::fs_load_files(
                names.as_ptr(),
                bytes.as_ptr(),
                sizes.as_ptr(),
                files.len() as c_int,
                &raw mut raw,
            )
        };
        Self::from_raw(raw, status, main)
    }

    fn from_raw(raw: *mut RawModel, status: c_int, name: &str) -> Result<Self, SimError> {
        check_as(status, |message| model_error(name, message))?;
        // SAFETY: MuJoCo just made this model for the caller; each `Data` keeps it alive by an `Arc`.
        let raw = unsafe { Owned::new(raw, "the model") }?;
        let mut sizes = Sizes::default();
        // SAFETY: the model is alive, and `sizes` is valid for writes.
        unsafe { ffi::fs_model_sizes(raw.as_ptr(), &raw mut sizes) };
        Ok(Self { shapes: OnceLock::new(), raw, sizes })
    }

    #[cfg(feature = "render")]
    pub(super) const fn as_mut_ptr(&mut self) -> *mut RawModel {
        self.raw.as_ptr()
    }

    pub(super) const fn as_ptr(&self) -> *const RawModel {
        self.raw.as_ptr()
    }

    /// Returns the physics time step, in seconds.
    #[must_use]
    pub const fn timestep(&self) -> f64 {
        self.sizes.timestep
    }

    /// Returns the shapes of the geoms, computed on the first call.
    pub(super) fn shapes(&self) -> Result<&Owned<RawShapes>, SimError> {
        let make = || {
            // SAFETY: the model is alive.
            let shapes = unsafe { ffi::fs_make_shapes(self.as_ptr()) };
            // SAFETY: the shapes were just made, and the model, which owns them, drops them first.
            unsafe { Owned::new(shapes, "the contact filter") }
        };
        self.shapes.get_or_init(make).as_ref().map_err(SimError::clone)
    }

    /// Lowers the number of constraints, and of numbers on the stack, for which each
    /// [`Data`](super::Data) reserves memory up to MuJoCo 2.x. Exceeding them is an error.
    pub(super) fn limit_sizes(&mut self, constraints: u16, stack: u32) {
        // SAFETY: the model is alive and not shared (`&mut`), and no data was made from it yet.
        unsafe {
            ffi::fs_limit_sizes(self.raw.as_ptr(), c_int::from(constraints), stack as c_int);
        }
    }

    /// Makes the collision search test every pair of geoms of two bodies near each other. That is
    /// faster than searching trees where tests are cheap and geoms are few, and finds the same
    /// contacts; those of two bodies come in the order of MuJoCo 2.
    pub(super) fn disable_midphase(&mut self) {
        // SAFETY: the model is alive and not shared (`&mut`).
        unsafe { ffi::fs_disable_midphase(self.raw.as_ptr()) };
    }

    /// Overwrites the leading numbers of every weld's data (`eq_data`).
    pub(super) fn set_weld_data(&mut self, values: &[f64; 7]) {
        // SAFETY: the model is alive and not shared (`&mut`); `eq_data` has at least 7 numbers for
        // each constraint in every version (7 until 2.2.0, and 11 since).
        unsafe { ffi::fs_set_weld_data(self.raw.as_ptr(), values.as_ptr(), 7) };
    }
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Model").field("sizes", &self.sizes).finish_non_exhaustive()
    }
}

fn model_error(name: &str, reason: impl ToString) -> SimError {
    SimError::Model { name: name.into(), reason: reason.to_string() }
}

fn c_string(text: &str, model: &str) -> Result<CString, SimError> {
    CString::new(text).map_err(|error| model_error(model, error))
}
