//! Drawing batches.

pub(crate) mod batch;
pub(crate) mod columns;
pub(crate) mod copy;
pub(crate) mod draws;
pub(crate) mod error;
pub(crate) mod gather;
pub(crate) mod goals;
pub(crate) mod importance;
pub(crate) mod mixture;
pub(crate) mod n_step;
pub(crate) mod outcome;
pub(crate) mod parallel;
pub(crate) mod sampler;
