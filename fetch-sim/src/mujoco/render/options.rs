use serde::{Deserialize, Serialize};

use super::{Camera, RenderError};

/// The greatest width and height of a picture, in pixels.
pub(super) const MAX_SIZE: u32 = 4096;

/// What pictures are to be like. The default is the reference's: 480 x 480 pixels, 4 samples.
///
/// ```
/// use fetch_sim::{Camera, RenderOptions};
///
/// // For a policy that sees through the gripper's camera.
/// let options = RenderOptions {
///     width: 84,
///     height: 84,
///     samples: 0,
///     camera: Camera::Named("gripper_camera_rgb".into()),
/// };
/// # assert_ne!(options, RenderOptions::default());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RenderOptions {
    /// Width in pixels, 1 to 4096.
    pub width: u32,
    /// Height in pixels, 1 to 4096.
    pub height: u32,
    /// Samples a pixel, for smooth edges: 0 for none (fastest); the driver may have fewer.
    pub samples: u8,
    /// From where pictures are taken.
    pub camera: Camera,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self { width: 480, height: 480, samples: 4, camera: Camera::default() }
    }
}

impl RenderOptions {
    pub(super) fn check_size(&self) -> Result<(), RenderError> {
        let Self { width, height, .. } = *self;
        let allowed = 1..=MAX_SIZE;
        if allowed.contains(&width) && allowed.contains(&height) {
            Ok(())
        } else {
            Err(RenderError::Size { width, height })
        }
    }
}
