//! OGBench's format: two archives of numpy arrays, for training and for validation.

mod column;
pub(super) mod writer;
