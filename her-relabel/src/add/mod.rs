//! Adding steps and episodes to a buffer.

mod append;
pub(crate) mod arguments;
pub(crate) mod check;
pub(crate) mod record;
pub(crate) mod recorder;
pub(crate) mod steps;
