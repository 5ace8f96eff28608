//! The settings of a run, their ranges, and the presets.

pub(crate) mod algorithm;
pub(crate) mod by_name;
pub(crate) mod pixels;
mod presets;
pub(crate) mod range;
pub(crate) mod train;
