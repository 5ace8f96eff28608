//! A compiled model: loading, sizes, and the changes made before it is shared.

use std::{
    ffi::{CString, c_int},
    fmt,
    path::Path,
    ptr, slice,
    sync::OnceLock,
};

use fetch_install::regular_file;

use super::{
    decoders::Decoders,
    ffi::{self, PhysicsArray, PhysicsArrays, RawArray, RawModel, RawShapes, Sizes},
    library::{Owned, c_path, check_as, load_once},
    unforked::unforked,
};
use crate::error::SimError;

/// A compiled MuJoCo model.
///
/// A model does not change once it is shared: any number of [`Data`](crate::Data), on any number of
/// threads, simulate the same model through an `Arc`.
pub struct Model {
    /// The geoms' shapes, prepared for contact filters; dropped before the model that they use.
    shapes: OnceLock<Result<Owned<RawShapes>, SimError>>,
    raw: Owned<RawModel>,
    pub(crate) sizes: Sizes,
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
    ncam: "cameras",
    nmocap: "mocap bodies",
}

impl Model {
    /// Compiles an MJCF file, including the files that it names.
    ///
    /// Some versions of MuJoCo read STL and OBJ files through plugins beside their library. They
    /// are loaded for the first model that needs them, into the copy of MuJoCo that this crate
    /// uses: a process with another copy of the same version must let this crate use that one
    /// (`MUJOCO_DIR`).
    ///
    /// If memory runs out, that is an error where MuJoCo asks C for it, as for the finished model.
    /// Where C++ asks, as for parts of a model that is being read, MuJoCo throws an exception,
    /// which ends the process by `abort`: no code outside of a library that has its own C++ runtime
    /// can catch it.
    ///
    /// A mesh without a thickness is an error, about which Qhull, a part of MuJoCo, also writes to
    /// standard error.
    ///
    /// # Errors
    /// [`SimError::Model`] with MuJoCo's message if the file cannot be read or compiled;
    /// [`SimError::Library`], [`SimError::MujocoDir`], [`SimError::BuiltWithoutMujoco`] or
    /// [`SimError::ShimMismatch`] if MuJoCo cannot be used.
    pub fn from_path(path: &Path) -> Result<Self, SimError> {
        let name = path.display().to_string();
        regular_file::check(path).map_err(|reason| model_error(&name, reason))?;
        let c_path = c_path(path).map_err(|reason| model_error(&name, reason))?;
        // SAFETY: the library is loaded, `c_path` is a C string and `raw` is valid for writes.
        Self::compile(&name, |raw| unsafe { ffi::fs_load_path(c_path.as_ptr(), raw) })
    }

    /// Compiles MJCF held in memory: pairs of file name and contents.
    ///
    /// The first file is the model; it may include the others by name.
    ///
    /// # Errors
    /// As [`from_path`](Self::from_path), also if there are more files than MuJoCo takes: 1,999
    /// until MuJoCo 3.1.
    pub fn from_files(files: &[(&str, &str)]) -> Result<Self, SimError> {
        let &[(main, _), ..] = files else {
            return Err(model_error("", "no file given"));
        };
        let names = files
            .iter()
            .map(|(name, _)| CString::new(*name))
            .collect::<Result<Vec<CString>, _>>()
            .map_err(|error| model_error(main, error))?;
        let names: Vec<_> = names.iter().map(|name| name.as_ptr()).collect();
        let bytes: Vec<_> = files.iter().map(|(_, text)| text.as_ptr()).collect();
        let sizes = files
            .iter()
            .map(|(_, text)| c_int::try_from(text.len()))
            .collect::<Result<Vec<_>, _>>()
            .map_err(|error| model_error(main, error))?;
        let (names, bytes, sizes) = (names.as_ptr(), bytes.as_ptr(), sizes.as_ptr());
        let count = files.len() as c_int;
        // SAFETY: the library is loaded; the three arrays have one valid entry for each file during
        // the call, which copies the contents; there are far fewer than 2^31 files; `raw` is valid
        // for writes.
        Self::compile(main, |raw| unsafe { ffi::fs_load_files(names, bytes, sizes, count, raw) })
    }

    /// Compiles a model with a function of the shim, which is called with the library loaded. If it
    /// fails before the mesh decoders were loaded, it is tried again with them.
    fn compile(
        name: &str,
        compile: impl Fn(*mut *mut RawModel) -> c_int,
    ) -> Result<Self, SimError> {
        load_once()?;
        let attempt = || {
            let mut raw = ptr::null_mut();
            let status = unforked(|| compile(&raw mut raw));
            check_as(status, explained).map(|()| raw)
        };
        let had_decoders = Decoders::are_settled();
        let raw = attempt().or_else(|reason| {
            let decoders = Decoders::load();
            let again = !had_decoders && decoders.loaded;
            let reason = if again { attempt() } else { Err(reason) };
            reason.map_err(|reason| {
                [slice::from_ref(&reason), &decoders.failures].concat().join("; ")
            })
        });
        Self::from_raw(raw.map_err(|reason| model_error(name, reason))?)
    }

    fn from_raw(raw: *mut RawModel) -> Result<Self, SimError> {
        // SAFETY: MuJoCo just made this model for the caller; each `Data` keeps it alive by an
        // `Arc`.
        let raw = unsafe { Owned::new(raw, "the model") }?;
        let mut sizes = Sizes::default();
        // SAFETY: the model is alive, and `sizes` is valid for writes.
        unsafe { ffi::fs_model_sizes(raw.as_ptr(), &raw mut sizes) };
        Ok(Self { shapes: OnceLock::new(), raw, sizes })
    }

    #[cfg(feature = "render")]
    pub(crate) const fn as_mut_ptr(&mut self) -> *mut RawModel {
        self.raw.as_ptr()
    }

    pub(crate) const fn as_ptr(&self) -> *const RawModel {
        self.raw.as_ptr()
    }

    /// Returns the physics time step, in seconds.
    #[must_use]
    pub const fn timestep(&self) -> f64 {
        self.sizes.timestep
    }

    /// Returns the shapes of the geoms, computed on the first call.
    pub(crate) fn shapes(&self) -> Result<&Owned<RawShapes>, SimError> {
        let make = || {
            // SAFETY: the model is alive.
            let shapes = unsafe { ffi::fs_make_shapes(self.as_ptr()) };
            // SAFETY: the shapes were just made, and the model, which owns them, drops them first.
            unsafe { Owned::new(shapes, "the contact filter") }
        };
        let shapes = self.shapes.get();
        let shapes = shapes.unwrap_or_else(|| unforked(|| self.shapes.get_or_init(make)));
        shapes.as_ref().map_err(SimError::clone)
    }

    /// Returns numbers that a copy of the model may change.
    pub(crate) fn physics(&self, array: PhysicsArray) -> &[f64] {
        let mut arrays = PhysicsArrays::default();
        // SAFETY: the model is alive and only read, and `arrays` is valid for writes.
        unsafe { ffi::fs_physics_arrays(self.raw.as_ptr(), &raw mut arrays) };
        let RawArray { first, len } = arrays[array as usize];
        if len == 0 {
            return &[]; // an empty array may have no address in C; a slice must have one
        }
        // SAFETY: the array has this length, does not change, and lives as long as the model.
        unsafe { slice::from_raw_parts(first, len) }
    }

    /// Lowers the number of constraints, and of numbers on the stack, for which each
    /// [`Data`](crate::Data) reserves memory up to MuJoCo 2.x. Exceeding them is an error.
    pub(crate) fn limit_sizes(&mut self, constraints: u16, stack: u32) {
        // SAFETY: the model is alive and not shared (`&mut`), and no data was made from it yet.
        unsafe {
            ffi::fs_limit_sizes(self.raw.as_ptr(), c_int::from(constraints), stack as c_int);
        }
    }

    /// Makes the collision search test every pair of geoms of two bodies near each other. That is
    /// faster than searching trees where tests are cheap and geoms are few, and finds the same
    /// contacts; those of two bodies come in the order of MuJoCo 2.
    pub(crate) fn disable_midphase(&mut self) {
        // SAFETY: the model is alive and not shared (`&mut`).
        unsafe { ffi::fs_disable_midphase(self.raw.as_ptr()) };
    }

    /// Overwrites the leading numbers of the data (`eq_data`) of every weld of the body with
    /// this index.
    pub(crate) fn set_weld_data(&mut self, body: usize, values: &[f64; 7]) {
        let (model, body) = (self.raw.as_ptr(), body as c_int);
        // SAFETY: the model is alive and not shared (`&mut`); `eq_data` has at least 7 numbers for
        // each constraint in every version (7 until 2.2.0, and 11 since).
        unsafe { ffi::fs_set_weld_data(model, body, values.as_ptr(), 7) };
    }
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Model").field("sizes", &self.sizes).finish_non_exhaustive()
    }
}

/// Explains the message of Qhull about a flat mesh, which later versions explain themselves.
fn explained(message: String) -> String {
    if message.contains("qhull error") {
        message + ": its points are coplanar, or nearly: give the mesh a thickness"
    } else {
        message
    }
}

fn model_error(name: &str, reason: impl ToString) -> SimError {
    SimError::Model { name: name.into(), reason: reason.to_string() }
}
