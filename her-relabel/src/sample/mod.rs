//! Drawing batches from a buffer.

pub(crate) mod acting;
pub(crate) mod aim;
pub(crate) mod batch;
pub(crate) mod columns;
pub(crate) mod copy;
pub(crate) mod draw;
pub(crate) mod draws;
pub(crate) mod form;
pub(crate) mod gather;
pub(crate) mod goals;
pub(crate) mod inputs;
mod memory;
mod mirror;
pub(crate) mod n_step;
pub(crate) mod noise;
pub(crate) mod outcome;
pub(crate) mod redraw;
pub(crate) mod sampler;
pub(crate) mod termination;
mod threads;
