//! Drawing batches from a buffer.

pub(crate) mod batch;
pub(crate) mod columns;
pub(crate) mod draw;
pub(crate) mod draws;
pub(crate) mod gather;
pub(crate) mod goals;
pub(crate) mod outcome;
pub(crate) mod sampler;
