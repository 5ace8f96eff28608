//! Ids of a model's objects, their names, and the properties that a model stores for them.

use std::{
    ffi::{CStr, CString, c_int},
    ptr, slice,
};

use super::{
    ffi::{self, ModelArray, ObjectKind, Sizes},
    library::check,
    model::Model,
};
use crate::error::SimError;

/// Declares the ids of a kind of objects, and how a model finds and names them.
macro_rules! ids {
    ($($(#[$doc:meta])* $id:ident: $kind:ident, $find:ident, $name:ident;)*) => {
        $(
            $(#[$doc])*
            #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
            pub struct $id(pub(crate) usize);

            impl $id {
                /// Returns the index in the model's order.
                #[must_use]
                pub const fn index(self) -> usize {
                    self.0
                }
            }
        )*

        impl Model {$(
            #[doc = concat!("Returns the ", stringify!($find), " with this name.\n")]
            /// # Errors
            /// [`SimError::MissingName`] if the model has none.
            pub fn $find(&self, name: &str) -> Result<$id, SimError> {
                self.find(ObjectKind::$kind, name).map($id)
            }

            #[doc = concat!("Returns the name of a ", stringify!($find), ", if it has one.\n")]
            /// # Errors
            /// [`SimError::UnknownId`]
            pub fn $name(&self, id: $id) -> Result<Option<&str>, SimError> {
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

impl BodyId {
    /// The world, in which all bodies are.
    pub(crate) const WORLD: Self = Self(0);
}

impl Model {
    /// Returns the index of a camera.
    #[cfg(feature = "render")]
    pub(crate) fn camera(&self, name: &str) -> Option<usize> {
        self.find(ObjectKind::Camera, name).ok()
    }

    fn find(&self, kind: ObjectKind, name: &str) -> Result<usize, SimError> {
        let missing = || SimError::MissingName { kind: kind.name(), name: name.into() };
        let c_name = CString::new(name).map_err(|_| missing())?;
        let mut id = -1;
        // SAFETY: the model is alive, the kind is one of the shim's, the name is a C string, and
        // `id` is valid for writes.
        check(unsafe {
            ffi::fs_name_to_id(self.as_ptr(), kind as c_int, c_name.as_ptr(), &raw mut id)
        })?;
        usize::try_from(id).map_err(|_| missing())
    }

    /// Returns the names of the cameras in the model's order; empty for one without a name.
    #[must_use]
    pub fn camera_names(&self) -> Vec<&str> {
        (0..self.sizes.ncam as usize)
            .map(|id| self.name(ObjectKind::Camera, id).ok().flatten().unwrap_or_default())
            .collect()
    }

    fn name(&self, kind: ObjectKind, id: usize) -> Result<Option<&str>, SimError> {
        let Sizes { nbody, njnt, ngeom, nsite, ncam, .. } = self.sizes;
        let count = [nbody, njnt, ngeom, nsite, ncam][kind as usize] as usize;
        if id >= count {
            return Err(SimError::UnknownId { kind: kind.name(), id, count });
        }
        let mut name = ptr::null();
        // SAFETY: the model is alive, the id is one of its own of this kind, and `name` is valid
        // for writes.
        check(unsafe {
            ffi::fs_id_to_name(self.as_ptr(), kind as c_int, id as c_int, &raw mut name)
        })?;
        // SAFETY: a C string that does not change and lives as long as the model.
        let name = (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) });
        Ok(name.and_then(|name| name.to_str().ok()))
    }

    /// Returns the index in `qpos` of a joint's first coordinate.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn qpos_address(&self, joint: JointId) -> Result<usize, SimError> {
        self.property(ModelArray::JntQposadr, ObjectKind::Joint, joint.0).map(|at| at as usize)
    }

    /// Returns the index in `qvel` of a joint's first degree of freedom.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn dof_address(&self, joint: JointId) -> Result<usize, SimError> {
        self.property(ModelArray::JntDofadr, ObjectKind::Joint, joint.0).map(|at| at as usize)
    }

    /// Returns the number of a joint's coordinates in `qpos`: 7 for a free joint, 4 for a ball, and
    /// 1 for a hinge or a slide.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn coordinate_count(&self, joint: JointId) -> Result<usize, SimError> {
        let start = self.qpos_address(joint)?;
        let next = self.array(ModelArray::JntQposadr).get(joint.0 + 1);
        Ok(next.map_or(self.nq(), |&next| next as usize) - start)
    }

    /// Returns the index of a body among the mocap bodies, if it is one.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn mocap_index(&self, body: BodyId) -> Result<Option<usize>, SimError> {
        let index = self.property(ModelArray::BodyMocapid, ObjectKind::Body, body.0)?;
        Ok(usize::try_from(index).ok())
    }

    /// Returns the body to which a geom is fixed.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn geom_body(&self, geom: GeomId) -> Result<BodyId, SimError> {
        let body = self.property(ModelArray::GeomBodyid, ObjectKind::Geom, geom.0)?;
        Ok(BodyId(body as usize))
    }

    /// Returns the shape of a geom: one of the shim's numbers, such as [`FS_BOX`](ffi::FS_BOX).
    pub(crate) fn geom_shape(&self, geom: usize) -> c_int {
        assert!(geom < self.ngeom(), "a geom of another model");
        // SAFETY: the model is alive, and the geom is one of its geoms.
        unsafe { ffi::fs_geom_shape(self.as_ptr(), geom as c_int) }
    }

    /// Returns the body to which a site is fixed.
    pub(crate) fn site_body(&self, site: SiteId) -> Result<BodyId, SimError> {
        let body = self.property(ModelArray::SiteBodyid, ObjectKind::Site, site.0)?;
        Ok(BodyId(body as usize))
    }

    /// Returns the parent of a body; the world's is the world.
    pub(crate) fn parent(&self, body: BodyId) -> Result<BodyId, SimError> {
        let parent = self.property(ModelArray::BodyParentid, ObjectKind::Body, body.0)?;
        Ok(BodyId(parent as usize))
    }

    /// Returns the first joint with which a body moves relative to its parent, if it has any.
    pub(crate) fn first_joint(&self, body: BodyId) -> Result<Option<JointId>, SimError> {
        let joint = self.property(ModelArray::BodyJntadr, ObjectKind::Body, body.0)?;
        Ok(usize::try_from(joint).ok().map(JointId))
    }

    /// Returns whether a body is `ancestor` or one of its descendants.
    ///
    /// # Errors
    /// [`SimError::UnknownId`]
    pub fn is_within(&self, mut body: BodyId, ancestor: BodyId) -> Result<bool, SimError> {
        loop {
            let parent = self.parent(body)?;
            if body == ancestor || body == BodyId::WORLD {
                return Ok(body == ancestor);
            }
            body = parent;
        }
    }

    /// Returns the joint that each actuator drives; `None` for one that drives something else.
    pub(crate) fn actuator_joints(&self) -> impl Iterator<Item = Option<JointId>> + '_ {
        (0..self.nu()).map(|actuator| {
            // SAFETY: the model is alive, and the actuator is one of its own.
            let joint = unsafe { ffi::fs_actuator_joint(self.as_ptr(), actuator as c_int) };
            usize::try_from(joint).ok().map(JointId)
        })
    }

    /// Returns the ids of the geoms or sites that are fixed to a body, as an array of their bodies says.
    pub(crate) fn fixed_to(&self, bodies: ModelArray, body: BodyId) -> Vec<usize> {
        let bodies = self.array(bodies).iter().enumerate();
        bodies.filter(|&(_, &of)| of as usize == body.0).map(|(id, _)| id).collect()
    }

    /// Returns the number that the model stores for an object, in an array with one number for each
    /// object of its kind.
    fn property(&self, array: ModelArray, kind: ObjectKind, id: usize) -> Result<c_int, SimError> {
        let numbers = self.array(array);
        let unknown = || SimError::UnknownId { kind: kind.name(), id, count: numbers.len() };
        numbers.get(id).copied().ok_or_else(unknown)
    }

    pub(crate) fn array(&self, array: ModelArray) -> &[c_int] {
        let mut len = 0;
        // SAFETY: the model is alive, the array is one of the shim's, and `len` is valid for
        // writes.
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
