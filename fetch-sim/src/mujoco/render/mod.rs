//! Pictures of a simulation, off screen.

mod error;
mod options;
mod renderer;

pub use error::RenderError;
pub use options::{Camera, FreeCamera, RenderOptions};
pub use renderer::{Renderer, Segment};
