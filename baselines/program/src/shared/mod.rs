//! Code that several commands share.

pub mod check;
#[cfg(feature = "full")]
pub mod choice;
pub(crate) mod env_id;
#[cfg(feature = "full")]
pub mod episodes;
#[cfg(feature = "full")]
pub mod folders;
pub mod json;
pub mod mujoco;
#[cfg(feature = "full")]
pub mod progress;
#[cfg(feature = "full")]
pub mod ranks;
pub mod reference;
#[cfg(feature = "full")]
pub(crate) mod signals;
#[cfg(feature = "full")]
pub mod tasks;
