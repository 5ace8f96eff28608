//! The visible geoms of a scene, for programs that draw them without MuJoCo.

use std::ffi::c_int;

use nalgebra::{Quaternion, Vector3};

use super::scene;
use crate::mujoco::binding::{
    ffi::{self, RawVisualGeom},
    ids::BodyId,
    model::Model,
};
use crate::{config::SimConfig, error::SimError};

/// The first group that viewers hide: the built-in model's shapes that only collide are in it.
const HIDDEN_GROUPS: c_int = 3;

/// A visible shape, fixed to a body.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct VisualGeom {
    /// Its form and size.
    pub shape: Shape,
    /// Red, green, blue and opacity, each from 0 to 1.
    pub rgba: [f32; 4],
    /// The body with which it moves; [`Data::body_pose`](crate::Data::body_pose) returns its pose.
    pub body: BodyId,
    /// Its center in the body's frame, in meters.
    pub position: Vector3<f64>,
    /// Its orientation in the body's frame.
    pub orientation: Quaternion<f64>,
}

/// The form of a geom around its own center, with sizes in meters. Long shapes lie along z.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A rectangle in x and y, visible from above.
    Plane {
        /// Half of its extent along x and y; 0 if it is infinite.
        half_size: [f64; 2],
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A cylinder with a hemisphere at each end.
    Capsule {
        /// Radius of the cylinder and of the hemispheres.
        radius: f64,
        /// Half of the cylinder's length, without the hemispheres.
        half_length: f64,
    },
    /// A ball stretched along the axes.
    Ellipsoid {
        /// Its three semi-axes.
        radii: [f64; 3],
    },
    /// A cylinder.
    Cylinder {
        /// Its radius.
        radius: f64,
        /// Half of its length.
        half_length: f64,
    },
    /// A box.
    Box {
        /// Half of its extent along each axis.
        half_size: [f64; 3],
    },
    /// A surface of triangles; closed and convex in the built-in model.
    Mesh {
        /// The three corners of each triangle, in meters in the geom's frame, counterclockwise as
        /// seen from outside.
        triangles: Vec<[[f64; 3]; 3]>,
    },
}

impl VisualGeom {
    /// Returns the visible geoms of the configured scene, including the robot but not the goal.
    /// Their bodies are those of the model that [`FetchModel::load`](crate::FetchModel::load)
    /// returns, although that model itself may have no purely visual geoms. Geoms of other forms,
    /// such as height fields, are left out.
    ///
    /// # Errors
    /// [`SimError::NoAssets`], [`SimError::Model`], [`SimError::OutOfRange`] or
    /// [`SimError::NoObject`] if the model cannot be loaded; [`SimError::Library`],
    /// [`SimError::MujocoDir`], [`SimError::BuiltWithoutMujoco`] or [`SimError::ShimMismatch`] if
    /// MuJoCo cannot be used.
    pub fn of(config: &SimConfig) -> Result<Vec<Self>, SimError> {
        let model = scene::load(config, scene::PICTURE)?;
        Ok((0..model.ngeom()).filter_map(|geom| Self::of_geom(&model, geom)).collect())
    }

    /// Returns `None` if the geom is hidden or has another form.
    fn of_geom(model: &Model, geom: usize) -> Option<Self> {
        let mut raw = RawVisualGeom::default();
        assert!(geom < model.ngeom(), "a geom of another model");
        // SAFETY: the model is alive, the geom is one of its geoms, and `raw` is valid for writes.
        unsafe { ffi::fs_get_visual_geom(model.as_ptr(), geom as c_int, &raw mut raw) };
        let triangle = |number| {
            let mut corners = [[0.0; 3]; 3];
            // SAFETY: as above; `number` is below the geom's number of triangles, which is 0 unless
            // it is a mesh, and `corners` is valid for writes of three points.
            unsafe {
                ffi::fs_get_triangle(model.as_ptr(), geom as c_int, number, corners.as_mut_ptr());
            }
            corners
        };
        let [a, b, _] = raw.size;
        let shape = match raw.shape {
            ffi::FS_PLANE => Shape::Plane { half_size: [a, b] },
            ffi::FS_SPHERE => Shape::Sphere { radius: a },
            ffi::FS_CAPSULE => Shape::Capsule { radius: a, half_length: b },
            ffi::FS_ELLIPSOID => Shape::Ellipsoid { radii: raw.size },
            ffi::FS_CYLINDER => Shape::Cylinder { radius: a, half_length: b },
            ffi::FS_BOX => Shape::Box { half_size: raw.size },
            ffi::FS_MESH => Shape::Mesh { triangles: (0..raw.ntriangle).map(triangle).collect() },
            _ => return None,
        };
        let [w, x, y, z] = raw.orientation;
        (raw.group < HIDDEN_GROUPS && raw.rgba[3] > 0.0).then(|| Self {
            shape,
            rgba: raw.rgba,
            body: BodyId(raw.body as usize),
            position: raw.position.into(),
            orientation: Quaternion::new(w, x, y, z),
        })
    }
}
