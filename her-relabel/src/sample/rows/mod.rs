//! What holds the rows of a batch, and how they are written.

pub(crate) mod acting;
pub(crate) mod batch;
pub(crate) mod columns;
pub(crate) mod copy;
pub(crate) mod form;
pub(crate) mod mirror;
