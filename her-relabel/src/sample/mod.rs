//! Drawing batches from a buffer.

pub(crate) mod draw;
pub(crate) mod error;
pub(crate) mod random;
pub(crate) mod rows;
pub(crate) mod settings;
