//! The Fetch environments.

pub(crate) mod config;
pub(crate) mod env;
mod euler;
pub(crate) mod make;
#[cfg(feature = "mujoco")]
pub(crate) mod make_vec;
pub(crate) mod observation;
pub(crate) mod reset;
#[cfg(feature = "mujoco")]
mod shared_model;
pub(crate) mod snapshot;
