//! The robot of the Fetch tasks on MuJoCo.

pub(crate) mod fetch_model;
pub(crate) mod scene;
pub(crate) mod simulator;
pub(crate) mod visual_geoms;
