//! Ids of a model's objects: looking them up by name, and what the model knows of them.

use std::{
    ffi::{CStr, CString, c_int},
    slice,
};

use super::{
    ffi::{self, ModelArray, ObjectKind},
    model::Model,
};
use crate::error::SimError;

macro_rules! ids {
    ($($(#[$doc:meta])* $name:ident)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub struct $name(pub(super) usize);
    )*};
}

ids! {
    /// A body of a model.
    BodyId
    /// A joint of a model.
    JointId
    /// A collision or display shape of a model.
    GeomId
    /// A site (a named frame on a body) of a model.
    SiteId
}

impl Model {
    /// Returns the body of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn body(&self, name: &str) -> Result<BodyId, SimError> {
        self.find(ObjectKind::Body, name).map(BodyId)
    }

    /// Returns the joint of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn joint(&self, name: &str) -> Result<JointId, SimError> {
        self.find(ObjectKind::Joint, name).map(JointId)
    }

    /// Returns the geom of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn geom(&self, name: &str) -> Result<GeomId, SimError> {
        self.find(ObjectKind::Geom, name).map(GeomId)
    }

    /// Returns the site of a name.
    ///
    /// # Errors
    /// [`SimError::MissingName`] if the model has none.
    pub fn site(&self, name: &str) -> Result<SiteId, SimError> {
        self.find(ObjectKind::Site, name).map(SiteId)
    }

    /// Returns the index of a camera.
    #[cfg(feature = "render")]
    pub(super) fn camera(&self, name: &str) -> Option<usize> {
        self.find(ObjectKind::Camera, name).ok()
    }

    fn find(&self, kind: ObjectKind, name: &str) -> Result<usize, SimError> {
        let missing = || SimError::MissingName { kind: kind.name(), name: name.into() };
        let c_name = CString::new(name).map_err(|_| missing())?;
        // SAFETY: the model is alive, the kind is one of the shim's, and the name is a C string.
        let id = unsafe { ffi::fs_name_to_id(self.as_ptr(), kind as c_int, c_name.as_ptr()) };
        usize::try_from(id).map_err(|_| missing())
    }

    /// Returns the name of a body, if it has one.
    ///
    /// # Panics
    /// If the body belongs to a larger model.
    #[must_use]
    pub fn body_name(&self, body: BodyId) -> Option<&str> {
        self.name(ObjectKind::Body, body.0)
    }

    /// Returns the name of a geom, if it has one.
    ///
    /// # Panics
    /// If the geom belongs to a larger model.
    #[must_use]
    pub fn geom_name(&self, geom: GeomId) -> Option<&str> {
        self.name(ObjectKind::Geom, geom.0)
    }

    /// Returns the name of a site, if it has one.
    ///
    /// # Panics
    /// If the site belongs to a larger model.
    #[must_use]
    pub fn site_name(&self, site: SiteId) -> Option<&str> {
        self.name(ObjectKind::Site, site.0)
    }

    /// Returns the names of the cameras in the model's order; empty for one without a name.
    #[cfg(feature = "render")]
    pub(super) fn camera_names(&self) -> Vec<&str> {
        (0..self.sizes.ncam as usize)
            .map(|id| self.name(ObjectKind::Camera, id).unwrap_or_default())
            .collect()
    }

    fn name(&self, kind: ObjectKind, id: usize) -> Option<&str> {
        let count = match kind {
            ObjectKind::Body => self.sizes.nbody,
            ObjectKind::Joint => self.sizes.njnt,
            ObjectKind::Geom => self.sizes.ngeom,
            ObjectKind::Site => self.sizes.nsite,
            ObjectKind::Camera => self.sizes.ncam,
        };
        assert!(id < count as usize, "a {} of another model", kind.name());
        // SAFETY: the model is alive and the id is one of its own of this kind.
        let name = unsafe { ffi::fs_id_to_name(self.as_ptr(), kind as c_int, id as c_int) };
        if name.is_null() {
            return None;
        }
        // SAFETY: a C string that does not change and lives as long as the model.
        unsafe { CStr::from_ptr(name) }.to_str().ok()
    }

    /// Returns the index in `qpos` of a joint's first coordinate.
    #[must_use]
    pub fn qpos_address(&self, joint: JointId) -> usize {
        self.array(ModelArray::JntQposadr, self.sizes.njnt)[joint.0] as usize
    }

    /// Returns the index in `qvel` of a joint's first degree of freedom.
    #[must_use]
    pub fn dof_address(&self, joint: JointId) -> usize {
        self.array(ModelArray::JntDofadr, self.sizes.njnt)[joint.0] as usize
    }

    /// Returns the index of a body among the mocap bodies, if it is one.
    #[must_use]
    pub fn mocap_index(&self, body: BodyId) -> Option<usize> {
        usize::try_from(self.array(ModelArray::BodyMocapid, self.sizes.nbody)[body.0]).ok()
    }

    /// Returns the body to which a geom is fixed.
    #[must_use]
    pub fn geom_body(&self, geom: GeomId) -> BodyId {
        BodyId(self.array(ModelArray::GeomBodyid, self.sizes.ngeom)[geom.0] as usize)
    }

    /// Whether a body is `ancestor` or one of its descendants.
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

    /// Returns the joint that an actuator drives; meaningless if it drives something else.
    pub(super) fn actuator_joint(&self, actuator: usize) -> JointId {
        JointId(self.array(ModelArray::ActuatorTrnid, 2 * self.sizes.nu)[2 * actuator] as usize)
    }

    fn array(&self, array: ModelArray, len: c_int) -> &[c_int] {
        // SAFETY: the model is alive and the array is one of the shim's.
        let first = unsafe { ffi::fs_model_array(self.as_ptr(), array as c_int) };
        if first.is_null() {
            return &[]; // an empty array may have no address in C; a slice must have one
        }
        // SAFETY: the array has the length that the model's sizes give it (mjxmacro.h), does not
        // change, and lives as long as the model.
        unsafe { slice::from_raw_parts(first, len as usize) }
    }
}

impl ObjectKind {
    const fn name(self) -> &'static str {
        match self {
            Self::Body => "body",
            Self::Joint => "joint",
            Self::Geom => "geom",
            Self::Site => "site",
            Self::Camera => "camera",
        }
    }
}
