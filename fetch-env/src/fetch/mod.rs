//! The Fetch environments.

mod action;
mod begin;
mod change;
pub(crate) mod config;
pub(crate) mod env;
pub(crate) mod env_id;
pub(crate) mod error;
mod euler;
mod interface;
pub(crate) mod kinematic;
pub(crate) mod layout;
#[cfg(feature = "mujoco")]
pub(crate) mod make;
pub(crate) mod observation;
pub(crate) mod reset;
pub(crate) mod snapshot;
pub(crate) mod start;
mod symmetry;
pub(crate) mod task;
pub(crate) mod variation;
