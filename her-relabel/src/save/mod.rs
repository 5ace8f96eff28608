//! Saving buffers and loading them.

pub(crate) mod persist;
pub(crate) mod stream;
