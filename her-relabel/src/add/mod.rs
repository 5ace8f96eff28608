//! Adding steps and episodes to a buffer.

mod append;
pub(crate) mod arguments;
pub(crate) mod check;
mod order;
pub(crate) mod record;
pub(crate) mod recorder;
mod resume;
pub(crate) mod steps;
