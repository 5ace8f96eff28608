use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::RenderError;

/// From where a picture is taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Camera {
    /// A camera of one's own; [`FreeCamera::REFERENCE`] by default.
    Free(FreeCamera),
    /// A camera of the model, by name: `head_camera_rgb`, `gripper_camera_rgb`, `lidar` and
    /// `external_camera_0` in all Fetch scenes.
    Named(String),
    /// A camera of the model, by its place in [`Renderer::camera_names`](super::Renderer::camera_names).
    Index(usize),
}

impl Default for Camera {
    fn default() -> Self {
        Self::Free(FreeCamera::REFERENCE)
    }
}

/// A camera that looks at a point of the world, upright.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeCamera {
    /// The point that is in the middle of the picture, in meters.
    pub lookat: Vector3<f64>,
    /// How far away from it the camera is, in meters.
    pub distance: f64,
    /// In which direction it looks, seen from above: degrees from the x axis, counter-clockwise.
    pub azimuth: f64,
    /// In which direction it looks: degrees above the horizon; negative looks down.
    pub elevation: f64,
}

impl FreeCamera {
    /// The camera of gymnasium-robotics 1.4.2 (`DEFAULT_CAMERA_CONFIG` in `envs/fetch/fetch_env.py`).
    pub const REFERENCE: Self = Self {
        lookat: Vector3::new(1.3, 0.75, 0.55),
        distance: 2.5,
        azimuth: 132.0,
        elevation: -14.0,
    };

    pub(super) fn check(&self) -> Result<(), RenderError> {
        let Self { lookat, distance, azimuth, elevation } = *self;
        let refuse = |field, value| Err(RenderError::FreeCamera { field, value });
        for (field, value) in [
            ("lookat.x", lookat.x),
            ("lookat.y", lookat.y),
            ("lookat.z", lookat.z),
            ("distance", distance),
            ("azimuth", azimuth),
            ("elevation", elevation),
        ] {
            if !value.is_finite() {
                return refuse(field, value);
            }
        }
        if distance <= 0.0 { refuse("distance", distance) } else { Ok(()) }
    }
}
