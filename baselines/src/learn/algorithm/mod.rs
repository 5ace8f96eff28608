//! Learning algorithms: their interface, and the two of this crate.

mod build;
mod critic;
pub(crate) mod ddpg;
pub(crate) mod interface;
pub(crate) mod sac;
mod sampled;
pub(crate) mod state_file;
