//! Pictures of a simulation, off screen.

mod error;
mod looks;
mod options;
mod pictures;
mod renderer;
mod segment;

pub use error::RenderError;
pub use options::{Camera, FreeCamera, RenderOptions};
pub use renderer::Renderer;
pub use segment::Segment;
