//! Ids of a model's objects, their names, and the properties that a model stores for them.

use std::{
    ffi::{CStr, CString, c_int},
    slice,
};

use super::{
    ffi::{self, ModelArray, ObjectKind, Sizes},
    model::Model,
};
use crate::error::SimError;

/// Declares the ids of a kind of objects, and how a model finds and names them.
macro_rules! ids {
    ($($(#[$doc:meta])* $id:ident: $kind:ident, $find:ident, $name:ident;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
            pub struct $id(pub(super) usize);
        )*

        impl Model {$(
            #[doc = concat!("Returns the ", stringify!($find), " with this name.\n")]
            /// # Errors
            /// [`SimError::MissingName`] if the model has none.
            pub fn $find(&self, name: &str) -> Result<$id, SimError> {
                self.find(ObjectKind::$kind, name).map($id)
            }

            #[doc = concat!("Returns the name of a ", stringify!($find), ", if it has one.\n")]
            /// # Panics
            /// If the id belongs to a larger model.
            #[must_use]
            pub fn $name(&self, id: $id) -> Option<&str> {
                self.name(ObjectKind::$kind, id.0)
            }
        )*}
    };
}

ids! {
    /// A body of a model.
    BodyId: Body, body, body_name;
    /// A joint of a model.
    JointId: Joint, joint, joint_name;
    /// A collision or display shape of a model.
    GeomId: Geom, geom, geom_name;
    /// A site (a named frame on a body) of a model.
    SiteId: Site, site, site_name;
}

impl Model {
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

    /// Returns the names of the cameras in the model's order; empty for one without a name.
    #[cfg(feature = "render")]
    pub(super) fn camera_names(&self) -> Vec<&str> {
        (0..self.sizes.ncam as usize)
            .map(|id| self.name(ObjectKind::Camera, id).unwrap_or_default())
            .collect()
    }

    fn name(&self, kind: ObjectKind, id: usize) -> Option<&str> {
        let Sizes { nbody, njnt, ngeom, nsite, ncam, .. } = self.sizes;
        let count = [nbody, njnt, ngeom, nsite, ncam][kind as usize];
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
        self.array(ModelArray::JntQposadr)[joint.0] as usize
    }

    /// Returns the index in `qvel` of a joint's first degree of freedom.
    #[must_use]
    pub fn dof_address(&self, joint: JointId) -> usize {
        self.array(ModelArray::JntDofadr)[joint.0] as usize
    }

    /// Returns the index of a body among the mocap bodies, if it is one.
    #[must_use]
    pub fn mocap_index(&self, body: BodyId) -> Option<usize> {
        usize::try_from(self.array(ModelArray::BodyMocapid)[body.0]).ok()
    }

    /// Returns the body to which a geom is fixed.
    #[must_use]
    pub fn geom_body(&self, geom: GeomId) -> BodyId {
        BodyId(self.array(ModelArray::GeomBodyid)[geom.0] as usize)
    }

    /// Whether a body is `ancestor` or one of its descendants.
    #[must_use]
    pub fn is_within(&self, mut body: BodyId, ancestor: BodyId) -> bool {
        let parents = self.array(ModelArray::BodyParentid);
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
        JointId(self.array(ModelArray::ActuatorTrnid)[2 * actuator] as usize)
    }

    fn array(&self, array: ModelArray) -> &[c_int] {
        let mut len = 0;
        // SAFETY: the model is alive, the array is one of the shim's, and `len` is valid for writes.
        let first = unsafe { ffi::fs_model_array(self.as_ptr(), array as c_int, &raw mut len) };
        if first.is_null() {
            return &[]; // an empty array may have no address in C; a slice must have one
        }
        // SAFETY: the array has this length, does not change, and lives as long as the model.
        unsafe { slice::from_raw_parts(first, len as usize) }
    }
}

impl ObjectKind {
    const fn name(self) -> &'static str {
        ["body", "joint", "geom", "site", "camera"][self as usize]
    }
}
