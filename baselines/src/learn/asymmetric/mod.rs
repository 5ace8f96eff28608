//! An asymmetric actor-critic: the critic sees the state, and an actor sees pictures.

mod actor;
mod memory;
mod trainer;
