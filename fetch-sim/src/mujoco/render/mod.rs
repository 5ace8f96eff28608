//! Pictures of a simulation, off screen.

mod error;
mod options;
mod pictures;
mod renderer;

pub use error::RenderError;
pub use options::{Camera, FreeCamera, RenderOptions};
pub use pictures::Segment;
pub use renderer::Renderer;
