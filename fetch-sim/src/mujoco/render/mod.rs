//! Pictures of a simulation, off screen.

mod canvas;
mod error;
mod options;
mod renderer;

pub use canvas::Segment;
pub use error::RenderError;
pub use options::{Camera, FreeCamera, RenderOptions};
pub use renderer::Renderer;
