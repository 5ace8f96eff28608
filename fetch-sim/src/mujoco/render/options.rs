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
#[must_use]
pub struct RenderOptions {
    width: u32,
    height: u32,
    samples: u8,
    camera: Camera,
    goals_shown: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        let camera = Camera::default();
        Self { width: 480, height: 480, samples: 4, camera, goals_shown: true }
    }
}

impl RenderOptions {
    settings! {
        /// Sets the width of pictures in pixels, 1 to 4096. The default, 480, is the reference's.
        with_width(width: u32);
        /// Returns the width of pictures, in pixels.
        width: u32;

        /// Sets the height of pictures in pixels, 1 to 4096. The default, 480, is the reference's.
        with_height(height: u32);
        /// Returns the height of pictures, in pixels.
        height: u32;

        /// Sets the number of samples per pixel, for smooth edges; the driver may use fewer. The
        /// default, 4, is MuJoCo's; 0 draws hard edges and is the fastest.
        with_samples(samples: u8);
        /// Returns the number of samples per pixel.
        samples: u8;

        /// Sets whether pictures show the goals. The default is true.
        with_goals_shown(goals_shown: bool);
        /// Whether pictures show the goals.
        goals_shown: bool;
    }

    /// Sets the camera. The default is the reference's, [`FreeCamera::REFERENCE`].
    pub fn with_camera(mut self, camera: Camera) -> Self {
        self.camera = camera;
        self
    }

    /// Returns the camera.
    #[must_use]
    pub const fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Checks everything that does not depend on a model, as [`Renderer::new`](crate::Renderer::new)
    /// does.
    ///
    /// # Errors
    /// [`RenderError::Size`] or [`RenderError::FreeCamera`].
    pub fn check(&self) -> Result<(), RenderError> {
        let Self { width, height, .. } = *self;
        if ![width, height].iter().all(|side| (1..=MAX_SIZE).contains(side)) {
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
    /// [`Renderer::camera_names`](crate::Renderer::camera_names).
    Index(usize),
}

impl Default for Camera {
    fn default() -> Self {
        Self::Free(FreeCamera::REFERENCE)
    }
}

/// A camera that looks at a point of the world, upright.
///
/// ```
/// use fetch_sim::FreeCamera;
///
/// let closer = FreeCamera { distance: 1.5, ..FreeCamera::REFERENCE };
/// # assert_eq!(closer.azimuth, 132.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeCamera {
    /// The point at the center of the picture, in meters.
    pub lookat: Vector3<f64>,
    /// Distance from that point to the camera, in meters; more than 0.
    pub distance: f64,
    /// Viewing direction as seen from above: degrees from the x axis, counterclockwise.
    pub azimuth: f64,
    /// Viewing direction relative to the horizon: degrees above it, negative to look down.
    pub elevation: f64,
}

impl FreeCamera {
    /// The camera of gymnasium-robotics 1.4.2 (`DEFAULT_CAMERA_CONFIG` in
    /// `envs/fetch/fetch_env.py`).
    pub const REFERENCE: Self = Self {
        lookat: Vector3::new(1.3, 0.75, 0.55),
        distance: 2.5,
        azimuth: 132.0,
        elevation: -14.0,
    };

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
