//! Learning algorithms: their interface, and the three of this crate.

mod build;
mod clipped;
mod critic;
pub(crate) mod ddpg;
pub(crate) mod interface;
pub(crate) mod ppo;
pub(crate) mod rollout;
pub(crate) mod sac;
mod sampled;
pub(crate) mod state_file;
