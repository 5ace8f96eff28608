//! What the user sets.

pub(crate) mod goals;
pub(crate) mod inputs;
pub(crate) mod n_step;
pub(crate) mod noise;
pub(crate) mod sampler;
pub(crate) mod termination;
