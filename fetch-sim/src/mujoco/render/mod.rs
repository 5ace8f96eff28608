//! Pictures of a simulation, off screen.

mod camera;
mod error;
mod ffi;
mod options;
mod renderer;
mod segment;

pub use camera::{Camera, FreeCamera};
pub use error::RenderError;
pub use options::RenderOptions;
pub use renderer::Renderer;
pub use segment::Segment;
