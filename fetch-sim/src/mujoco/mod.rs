//! The MuJoCo implementation of [`Simulator`](crate::Simulator), and the safe binding below it.

mod builtin;
mod contact_filter;
mod data;
mod fetch_model;
mod ffi;
mod library;
mod model;
mod simulator;
mod snapshot;

pub use contact_filter::{ContactFilter, ContactFilterCounts};
pub use data::Data;
pub use fetch_model::FetchModel;
pub use library::MujocoVersion;
pub use model::{BodyId, GeomId, JointId, Model, SiteId};
pub use simulator::MujocoSimulator;
pub use snapshot::MujocoSnapshot;
