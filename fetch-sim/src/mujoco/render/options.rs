//! Settings of a renderer: the size of its pictures and the camera.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::error::{MAX_SIZE, RenderError};

/// Settings of a renderer. The default is the reference's: 480 x 480 pixels, 4 samples, its camera.
///
/// ```
/// use fetch_sim::{Camera, RenderOptions};
///
/// // For a policy that sees through the gripper's camera.
/// let options = RenderOptions::default()
///     .with_width(84)
///     .with_height(84)
///     .with_samples(0)
///     .with_camera(Camera::Named("gripper_camera_rgb".into()));
/// # assert_ne!(options, RenderOptions::default());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderOptions {
    width: u32,
    height: u32,
    samples: u8,
    camera: Camera,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { width: 480, height: 480, samples: 4, camera: Camera::default() }
    }
}

impl RenderOptions {
    /// Sets the width of pictures in pixels, 1 to 4096. The default, 480, is the reference's.
    #[must_use]
    pub const fn with_width(mut self, width: u32) -> Self {
        self.width = width;
        self
    }

    /// Sets the height of pictures in pixels, 1 to 4096. The default, 480, is the reference's.
    #[must_use]
    pub const fn with_height(mut self, height: u32) -> Self {
        self.height = height;
        self
    }

    /// Sets the number of samples per pixel, for smooth edges; the driver may use fewer. The default,
    /// 4, is MuJoCo's; 0 draws hard edges and is the fastest.
    #[must_use]
    pub const fn with_samples(mut self, samples: u8) -> Self {
        self.samples = samples;
        self
    }

    /// Sets the camera. The default is the reference's, [`FreeCamera::REFERENCE`].
    #[must_use]
    pub fn with_camera(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// Returns the width of pictures, in pixels.
    #[must_use]
    pub const fn width(&self) -> u32 {
        self.width
    }

    /// Returns the height of pictures, in pixels.
    #[must_use]
    pub const fn height(&self) -> u32 {
        self.height
    }

    /// Returns the number of samples per pixel.
    #[must_use]
    pub const fn samples(&self) -> u8 {
        self.samples
    }

    /// Returns the camera.
    #[must_use]
    pub const fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Checks everything that does not depend on a model.
    pub(super) fn check(&self) -> Result<(), RenderError> {
        let Self { width, height, .. } = *self;
        let allowed = 1..=MAX_SIZE;
        if !allowed.contains(&width) || !allowed.contains(&height) {
            return Err(RenderError::Size { width, height });
        }
        match &self.camera {
            Camera::Free(camera) => camera.check(),
            Camera::Named(_) | Camera::Index(_) => Ok(()),
        }
    }
}

/// The camera that takes a picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Camera {
    /// A camera that is not part of the model; the default is [`FreeCamera::REFERENCE`].
    Free(FreeCamera),
    /// A camera of the model, by name: `head_camera_rgb`, `gripper_camera_rgb`, `lidar` and
    /// `external_camera_0` in all Fetch scenes.
    Named(String),
    /// A camera of the model, by its index in
    /// [`Renderer::camera_names`](super::Renderer::camera_names).
    Index(usize),
}

impl Default for Camera {
    fn default() -> Self {
        Self::Free(FreeCamera::REFERENCE)
    }
}

/// A camera that looks at a point of the world, upright. The default is
/// [`REFERENCE`](Self::REFERENCE).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeCamera {
    lookat: Vector3<f64>,
    distance: f64,
    azimuth: f64,
    elevation: f64,
}

impl Default for FreeCamera {
    fn default() -> Self {
        Self::REFERENCE
    }
}

impl FreeCamera {
    /// The camera of gymnasium-robotics 1.4.2 (`DEFAULT_CAMERA_CONFIG` in `envs/fetch/fetch_env.py`).
    pub const REFERENCE: Self = Self {
        lookat: Vector3::new(1.3, 0.75, 0.55),
        distance: 2.5,
        azimuth: 132.0,
        elevation: -14.0,
    };

    /// Sets the point at the center of the picture, in meters. The reference's is (1.3, 0.75, 0.55).
    #[must_use]
    pub const fn with_lookat(mut self, lookat: Vector3<f64>) -> Self {
        self.lookat = lookat;
        self
    }

    /// Sets the distance from that point to the camera, in meters; more than 0. The reference's is
    /// 2.5.
    #[must_use]
    pub const fn with_distance(mut self, distance: f64) -> Self {
        self.distance = distance;
        self
    }

    /// Sets the viewing direction as seen from above: degrees from the x axis, counterclockwise. The
    /// reference's is 132.
    #[must_use]
    pub const fn with_azimuth(mut self, azimuth: f64) -> Self {
        self.azimuth = azimuth;
        self
    }

    /// Sets the viewing direction relative to the horizon: degrees above it, negative to look down.
    /// The reference's is -14.
    #[must_use]
    pub const fn with_elevation(mut self, elevation: f64) -> Self {
        self.elevation = elevation;
        self
    }

    /// Returns the point at the center of the picture, in meters.
    #[must_use]
    pub const fn lookat(&self) -> Vector3<f64> {
        self.lookat
    }

    /// Returns the distance from that point to the camera, in meters.
    #[must_use]
    pub const fn distance(&self) -> f64 {
        self.distance
    }

    /// Returns the viewing direction as seen from above, in degrees from the x axis.
    #[must_use]
    pub const fn azimuth(&self) -> f64 {
        self.azimuth
    }

    /// Returns the viewing direction relative to the horizon, in degrees above it.
    #[must_use]
    pub const fn elevation(&self) -> f64 {
        self.elevation
    }

    pub(super) fn check(&self) -> Result<(), RenderError> {
        let is_bad = |&(field, value): &(_, f64)| {
            !value.is_finite() || (field == "distance" && value <= 0.0)
        };
        match self.numbers().into_iter().find(is_bad) {
            None => Ok(()),
            Some((field, value)) => Err(RenderError::FreeCamera { field, value }),
        }
    }

    /// Returns the numbers, with their names, in the shim's order.
    pub(super) fn numbers(&self) -> [(&'static str, f64); 6] {
        let [x, y, z] = self.lookat.into();
        [
            ("lookat.x", x),
            ("lookat.y", y),
            ("lookat.z", z),
            ("distance", self.distance),
            ("azimuth", self.azimuth),
            ("elevation", self.elevation),
        ]
    }
}
