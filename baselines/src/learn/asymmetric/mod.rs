//! An asymmetric actor-critic: the critic sees the state, and an actor sees pictures.

mod actor;
mod memory;
pub(super) mod settings;
mod trainer;
