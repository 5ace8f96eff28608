//! Errors of rendering.

use crate::error::SimError;

/// The greatest width and height of a picture, in pixels.
pub(super) const MAX_SIZE: u32 = 4096;

const WAY_TO_OPENGL: &str = if cfg!(any(windows, target_vendor = "apple")) {
    "render on Linux"
} else {
    "install libegl1 and libgl1-mesa-dri, or libosmesa6"
};

/// Error returned when a picture cannot be made.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The machine has no OpenGL that can draw without a window.
    #[error(
        "there is no OpenGL to render with ({reason}): {WAY_TO_OPENGL}; everything else works \
         without it"
    )]
    NoOpenGl {
        /// The cause.
        reason: String,
    },
    /// The picture has no pixels, or too many.
    #[error(
        "a picture of {width} x {height} pixels cannot be rendered: choose 1 to {MAX_SIZE} for each"
    )]
    Size {
        /// Its width, in pixels.
        width: u32,
        /// Its height, in pixels.
        height: u32,
    },
    /// The model has no such camera.
    #[error("the model has no camera {camera}: use one of {}", known.join(", "))]
    UnknownCamera {
        /// The requested name or index.
        camera: String,
        /// The names of the model's cameras.
        known: Vec<String>,
    },
    /// A number of a free camera is invalid.
    #[error("the camera's {field} is {value:?}: use finite numbers, and a distance greater than 0")]
    FreeCamera {
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The simulation and the renderer have different models.
    #[error(
        "the simulation is of {simulation}, the renderer of {renderer}: make one renderer for each \
         model"
    )]
    OtherModel {
        /// Task and model of the simulation.
        simulation: String,
        /// Task and model of the renderer.
        renderer: String,
    },
    /// OpenGL was in use before a `fork`, and this process is the child.
    #[error(
        "OpenGL was in use when this process was forked, and its threads are those of the parent: \
         fork before the first renderer is made, or start a new program"
    )]
    Forked,
    /// MuJoCo's renderer or OpenGL failed.
    #[error("rendering failed ({message}): make a new renderer")]
    Failed {
        /// Message of MuJoCo or OpenGL.
        message: String,
    },
    /// The model could not be loaded.
    #[error(transparent)]
    Sim(#[from] SimError),
}

debug_as_display!(RenderError);
