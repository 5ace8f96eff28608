use std::{
    ffi::{CStr, CString, c_int},
    fmt,
    path::Path,
    ptr::{self, NonNull},
    slice,
    sync::OnceLock,
};

use super::{
    contact_filter::Shapes,
    ffi::{self, RawModel, Sizes},
    ids::{BodyId, GeomId, JointId, ObjectKind, SiteId},
    library::{check, library},
};
use crate::SimError;

/// A compiled MuJoCo model.
///
/// It does not change once it is shared: any number of [`Data`](super::Data), on any number of
/// threads, simulate the same model through an `Arc`.
pub struct Model {
    raw: NonNull<RawModel>,
    sizes: Sizes,
    shapes: OnceLock<Result<Shapes, SimError>>,
}

// SAFETY: an mjModel is plain memory that belongs to no thread, and `Model` owns it.
unsafe impl Send for Model {}
// SAFETY: MuJoCo only reads an mjModel that it is handed as const, and every method that takes
// `&self` passes it as const.
unsafe impl Sync for Model {}

/// The shim's numbering of the model's integer arrays.
#[derive(Clone, Copy)]
enum ModelArray {
    JntQposadr,
    JntDofadr,
    BodyMocapid,
    BodyParentid,
    GeomBodyid,
    ActuatorTrnid,
}

impl Model {
    /// Compiles an MJCF file, with whatever it includes.
    ///
    /// # Errors
    /// [`SimError::Model`] with MuJoCo's message if the file cannot be read or compiled;
    /// [`SimError::Library`] or [`SimError::VersionMismatch`] if MuJoCo cannot be used.
    pub fn from_path(path: &Path) -> Result<Self, SimError> {
        library()?;
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
        library()?;
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
            .map_err(|error| SimError::Model { name: main.into(), reason: error.to_string() })?;
        let mut raw = ptr::null_mut();
        // SAFETY: the library is loaded; the three arrays have one valid entry a file, for as long
        // as the call, which copies the contents; there are far fewer than 2^31 files.
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
        check(status).map_err(|error| match error {
            SimError::Mujoco { message } => SimError::Model { name: name.into(), reason: message },
            other => other,
        })?;
        let raw = NonNull::new(raw).ok_or_else(|| SimError::Model {
            name: name.into(),
            reason: "MuJoCo gave no reason".into(),
        })?;
        let mut sizes = Sizes::default();
        // SAFETY: `raw` is a model that MuJoCo just made, and `sizes` is valid for writes.
        unsafe { ffi::fs_model_sizes(raw.as_ptr(), &raw mut sizes) };
        Ok(Self { raw, sizes, shapes: OnceLock::new() })
    }

    #[cfg(feature = "render")]
    pub(super) const fn as_mut_ptr(&mut self) -> *mut RawModel {
        self.raw.as_ptr()
    }

    pub(super) const fn as_ptr(&self) -> *const RawModel {
        self.raw.as_ptr()
    }

    /// Number of position coordinates.
    #[must_use]
    pub const fn nq(&self) -> usize {
        self.sizes.nq as usize
    }

    /// Number of degrees of freedom.
    #[must_use]
    pub const fn nv(&self) -> usize {
        self.sizes.nv as usize
    }

    /// Number of actuators.
    #[must_use]
    pub const fn nu(&self) -> usize {
        self.sizes.nu as usize
    }

    /// Number of bodies, the world included.
    #[must_use]
    pub const fn nbody(&self) -> usize {
        self.sizes.nbody as usize
    }

    /// Number of geoms.
    #[must_use]
    pub const fn ngeom(&self) -> usize {
        self.sizes.ngeom as usize
    }

    /// Number of sites.
    #[must_use]
    pub const fn nsite(&self) -> usize {
        self.sizes.nsite as usize
    }

    /// Number of mocap bodies.
    #[must_use]
    pub const fn nmocap(&self) -> usize {
        self.sizes.nmocap as usize
    }

    /// Physics time step, in seconds.
    #[must_use]
    pub const fn timestep(&self) -> f64 {
        self.sizes.timestep
    }

    /// The body of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn body(&self, name: &str) -> Result<BodyId, SimError> {
        self.find(ObjectKind::Body, name).map(BodyId)
    }

    /// The joint of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn joint(&self, name: &str) -> Result<JointId, SimError> {
        self.find(ObjectKind::Joint, name).map(JointId)
    }

    /// The geom of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn geom(&self, name: &str) -> Result<GeomId, SimError> {
        self.find(ObjectKind::Geom, name).map(GeomId)
    }

    /// The site of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn site(&self, name: &str) -> Result<SiteId, SimError> {
        self.find(ObjectKind::Site, name).map(SiteId)
    }

    fn find(&self, kind: ObjectKind, name: &str) -> Result<usize, SimError> {
        let missing = || SimError::MissingName { kind: kind.name(), name: name.into() };
        let c_name = CString::new(name).map_err(|_| missing())?;
        // SAFETY: the model is alive, the kind is one of the shim's, the name is a C string.
        let id = unsafe { ffi::fs_name_to_id(self.as_ptr(), kind as c_int, c_name.as_ptr()) };
        usize::try_from(id).map_err(|_| missing())
    }

    /// The name of a body, if it has one.
    ///
    /// # Panics
    /// If the body is of a larger model.
    #[must_use]
    pub fn body_name(&self, body: BodyId) -> Option<&str> {
        self.name(ObjectKind::Body, body.0, self.sizes.nbody)
    }

    /// The name of a geom, if it has one.
    ///
    /// # Panics
    /// If the geom is of a larger model.
    #[must_use]
    pub fn geom_name(&self, geom: GeomId) -> Option<&str> {
        self.name(ObjectKind::Geom, geom.0, self.sizes.ngeom)
    }

    /// The name of a site, if it has one.
    ///
    /// # Panics
    /// If the site is of a larger model.
    #[must_use]
    pub fn site_name(&self, site: SiteId) -> Option<&str> {
        self.name(ObjectKind::Site, site.0, self.sizes.nsite)
    }

    fn name(&self, kind: ObjectKind, id: usize, count: c_int) -> Option<&str> {
        assert!(id < count as usize, "a {} of another model", kind.name());
        // SAFETY: the model is alive and the id is one of its own of this kind.
        let name = unsafe { ffi::fs_id_to_name(self.as_ptr(), kind as c_int, id as c_int) };
        if name.is_null() {
            return None;
        }
        // SAFETY: a C string that lives and stays as long as the model.
        unsafe { CStr::from_ptr(name) }.to_str().ok()
    }

    /// Where a joint's coordinates begin in `qpos`.
    #[must_use]
    pub fn qpos_address(&self, joint: JointId) -> usize {
        self.array(ModelArray::JntQposadr, self.sizes.njnt)[joint.0] as usize
    }

    /// Where a joint's degrees of freedom begin in `qvel`.
    #[must_use]
    pub fn dof_address(&self, joint: JointId) -> usize {
        self.array(ModelArray::JntDofadr, self.sizes.njnt)[joint.0] as usize
    }

    /// The index of a body among the mocap bodies, if it is one.
    #[must_use]
    pub fn mocap_index(&self, body: BodyId) -> Option<usize> {
        usize::try_from(self.array(ModelArray::BodyMocapid, self.sizes.nbody)[body.0]).ok()
    }

    /// The body that a geom is fixed to.
    #[must_use]
    pub fn geom_body(&self, geom: GeomId) -> BodyId {
        BodyId(self.array(ModelArray::GeomBodyid, self.sizes.ngeom)[geom.0] as usize)
    }

    /// Whether a body is `ancestor` or hangs below it.
    #[must_use]
    pub fn is_within(&self, mut body: BodyId, ancestor: BodyId) -> bool {
        let parents = self.array(ModelArray::BodyParentid, self.sizes.nbody);
        while body != ancestor {
            if body.0 == 0 {
                return false;
            }
            body = BodyId(parents[body.0] as usize);
        }
        true
    }

    /// The joint that an actuator drives; meaningless if it drives something else.
    pub(super) fn actuator_joint(&self, actuator: usize) -> JointId {
        JointId(self.array(ModelArray::ActuatorTrnid, 2 * self.sizes.nu)[2 * actuator] as usize)
    }

    /// The shapes of its geoms, made when they are first asked for.
    pub(super) fn shapes(&self) -> Result<&Shapes, SimError> {
        // SAFETY: the model is alive, and the shapes, dropped with it, are lent no longer than it.
        let make = || unsafe { Shapes::new(self.as_ptr()) };
        self.shapes.get_or_init(make).as_ref().map_err(SimError::clone)
    }

    fn array(&self, array: ModelArray, len: c_int) -> &[c_int] {
        // SAFETY: the model is alive and the field is one of the shim's.
        let first = unsafe { ffi::fs_model_field(self.as_ptr(), array as c_int) };
        if first.is_null() {
            return &[]; // C may have no address for an empty array; a slice must
        }
        // SAFETY: the array has the length that the model's sizes give it (mjxmacro.h), and lives
        // and stays as long as the model.
        unsafe { slice::from_raw_parts(first, len as usize) }
    }

    /// Lowers how many constraints, and how many numbers on the stack, each [`Data`](super::Data)
    /// has room for, where MuJoCo reserves it beforehand (until 2.x). More of them are an error.
    pub(super) fn limit_sizes(&mut self, constraints: u16, stack: u32) {
        // SAFETY: the model is alive and not shared (`&mut`), and no data was made from it yet.
        unsafe {
            ffi::fs_limit_sizes(self.raw.as_ptr(), c_int::from(constraints), stack as c_int);
        }
    }

    /// Lets the collision search test every pair of geoms of two bodies near each other. That is
    /// faster than its trees where tests are cheap and geoms are few, and finds the same contacts;
    /// those of two bodies come in the order of MuJoCo 2.
    pub(super) fn disable_midphase(&mut self) {
        // SAFETY: the model is alive and not shared (`&mut`).
        unsafe { ffi::fs_disable_midphase(self.raw.as_ptr()) };
    }

    /// Overwrites the leading numbers of every weld's data (`eq_data`).
    pub(super) fn set_weld_data(&mut self, values: &[f64; 7]) {
        // SAFETY: the model is alive and not shared (`&mut`); `eq_data` has at least 7 numbers for
        // each constraint in every version (it had 7 until 2.2.0, and 11 since).
        unsafe { ffi::fs_set_weld_data(self.raw.as_ptr(), values.as_ptr(), 7) };
    }
}

impl Drop for Model {
    fn drop(&mut self) {
        // SAFETY: `raw` is owned, and every `Data` that uses it holds an `Arc` of this value.
        unsafe { ffi::fs_delete_model(self.raw.as_ptr()) };
    }
}

impl fmt::Debug for Model {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Model").field("sizes", &self.sizes).finish_non_exhaustive()
    }
}

fn c_string(text: &str, model: &str) -> Result<CString, SimError> {
    CString::new(text)
        .map_err(|error| SimError::Model { name: model.into(), reason: error.to_string() })
}
