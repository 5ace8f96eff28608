use super::options::MAX_SIZE;
use crate::SimError;

/// Why a picture could not be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The machine has no OpenGL that draws without a window.
    #[error(
        "there is no OpenGL to render with ({reason}): install libegl1 and libgl1-mesa-dri, or libosmesa6; everything else works without"
    )]
    NoOpenGl {
        /// What was found out.
        reason: String,
    },
    /// The picture has no pixels, or too many.
    #[error("a picture of {width} x {height} pixels cannot be rendered: give 1 to {MAX_SIZE} each")]
    Size {
        /// Its width, in pixels.
        width: u32,
        /// Its height, in pixels.
        height: u32,
    },
    /// The model has no such camera.
    #[error("the model has no camera {camera}: it has {}", known.join(", "))]
    UnknownCamera {
        /// Name or index that was asked for.
        camera: String,
        /// The cameras that there are.
        known: Vec<String>,
    },
    /// A number of a free camera cannot be.
    #[error("the camera's {field} is {value}: give finite numbers, and a distance greater than 0")]
    FreeCamera {
        /// The field.
        field: &'static str,
        /// Its value.
        value: f64,
    },
    /// The simulation is not of the model that the renderer draws.
    #[error(
        "the simulation is of {simulation}, the renderer of {renderer}: make one renderer for each model"
    )]
    OtherModel {
        /// Task and model of the simulation.
        simulation: String,
        /// Task and model of the renderer.
        renderer: String,
    },
    /// MuJoCo's renderer or OpenGL failed.
    #[error("rendering failed ({message}): make a new renderer")]
    Failed {
        /// What MuJoCo or OpenGL said.
        message: String,
    },
    /// The model could not be loaded.
    #[error(transparent)]
    Sim(#[from] SimError),
}
