//! The MuJoCo implementation of [`Simulator`](crate::Simulator), and the safe binding below it.

mod builtin;
mod data;
mod fetch_model;
mod ffi;
mod library;
mod model;
mod simulator;
mod snapshot;
mod visual_geoms;

pub use data::Data;
pub use fetch_model::FetchModel;
pub use library::MujocoVersion;
pub use model::{BodyId, GeomId, JointId, Model, SiteId};
pub use simulator::MujocoSimulator;
pub use snapshot::MujocoSnapshot;
pub use visual_geoms::{Shape, VisualGeom};
