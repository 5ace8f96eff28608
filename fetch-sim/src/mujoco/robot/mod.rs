//! The robot of the Fetch tasks on MuJoCo.

mod bodies;
pub(crate) mod data_mut;
pub(crate) mod fetch_model;
mod names;
mod observer;
pub(crate) mod scene;
pub(crate) mod simulator;
pub(crate) mod snapshot;
mod vary;
pub(crate) mod visual_geoms;
