//! Pictures of environments: rendered, observed and recorded.

#[cfg(feature = "clip")]
pub mod clip;
#[cfg(feature = "render")]
pub(crate) mod frames;
#[cfg(feature = "render")]
pub(crate) mod observations;
#[cfg(feature = "render")]
pub(crate) mod pixels;
#[cfg(feature = "render")]
mod pool;
#[cfg(feature = "render")]
pub(crate) mod render;
#[cfg(feature = "render")]
pub(crate) mod view;
