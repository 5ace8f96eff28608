//! Adding steps and episodes to a buffer.

mod append;
pub(crate) mod arguments;
pub(crate) mod check;
mod order;
pub(crate) mod record;
mod resume;
pub(crate) mod steps;
pub(crate) mod unfinished;
