use std::ffi::c_int;

use nalgebra::{Quaternion, Vector3};

use super::{
    builtin,
    ffi::{self, RawVisualGeom},
    ids::BodyId,
    model::Model,
};
use crate::{SimError, Task};

/// Viewers show the groups below this one; the built-in model keeps what only touches above.
const HIDDEN_GROUPS: c_int = 3;

/// A shape to be seen, fixed to a body.
#[derive(Clone, Debug, PartialEq)]
pub struct VisualGeom {
    /// Its form and size.
    pub shape: Shape,
    /// Red, green, blue and opacity, 0 to 1.
    pub rgba: [f32; 4],
    /// The body that it moves with: ask [`Data::body_pose`](crate::Data::body_pose).
    pub body: BodyId,
    /// Its center in the body's frame, in meters.
    pub position: Vector3<f64>,
    /// Its orientation in the body's frame.
    pub orientation: Quaternion<f64>,
}

/// The form of a geom around its own center, sizes in meters. Long shapes lie along z.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Shape {
    /// A rectangle in x and y, seen from above.
    Plane {
        /// Half of its extent along x and y; 0 is without end.
        half_size: [f64; 2],
    },
    /// A ball.
    Sphere {
        /// Its radius.
        radius: f64,
    },
    /// A cylinder with a half ball on each end.
    Capsule {
        /// Radius of the cylinder and of the half balls.
        radius: f64,
        /// Half of the cylinder's length, without the half balls.
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
    /// A surface of triangles. Those of the built-in model are closed and convex.
    Mesh {
        /// The three corners of each triangle, in meters in the geom's frame, counter-clockwise as
        /// seen from outside.
        triangles: Vec<[[f64; 3]; 3]>,
    },
}

impl VisualGeom {
    /// What there is to see in a task's scene with the built-in model: scene and robot, without the
    /// goal. The bodies are those of the model that [`FetchModel::load`](crate::FetchModel::load)
    /// makes, which itself leaves out the shapes that are only seen.
    ///
    /// # Errors
    /// [`SimError::Library`] or [`SimError::VersionMismatch`] if MuJoCo cannot be used.
    pub fn of_builtin(task: Task) -> Result<Vec<Self>, SimError> {
        let model = builtin::load_visible(task)?;
        Ok((0..model.ngeom()).filter_map(|geom| Self::of(&model, geom)).collect())
    }

    /// `None` for what is hidden or of another form.
    fn of(model: &Model, geom: usize) -> Option<Self> {
        let mut raw = RawVisualGeom::default();
        assert!(geom < model.ngeom(), "a geom of another model");
        // SAFETY: the model is alive, the geom is one of its geoms, and `raw` is valid for writes.
        unsafe { ffi::fs_get_visual_geom(model.as_ptr(), geom as c_int, &raw mut raw) };
        let triangle = |number| {
            let mut corners = [[0.0; 3]; 3];
            // SAFETY: as above, `number` is below the geom's number of triangles, which is 0 if it
            // is no mesh, and `corners` is valid for writes of three points.
            unsafe {
                ffi::fs_get_triangle(model.as_ptr(), geom as c_int, number, corners.as_mut_ptr());
            }
            corners
        };
        let [a, b, _] = raw.size;
        let shape = match raw.shape {
            0 => Shape::Plane { half_size: [a, b] },
            1 => Shape::Sphere { radius: a },
            2 => Shape::Capsule { radius: a, half_length: b },
            3 => Shape::Ellipsoid { radii: raw.size },
            4 => Shape::Cylinder { radius: a, half_length: b },
            5 => Shape::Box { half_size: raw.size },
            6 => Shape::Mesh { triangles: (0..raw.triangle_count).map(triangle).collect() },
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
