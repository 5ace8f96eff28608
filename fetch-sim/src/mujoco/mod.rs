//! The MuJoCo implementation of [`Simulator`](crate::Simulator), and the safe binding below it.

mod contact_filter;
mod data;
mod decoders;
mod fetch_model;
mod ffi;
mod ids;
mod library;
mod library_file;
mod model;
mod poses;
#[cfg(feature = "render")]
mod render;
mod scene;
mod search;
mod simulator;
mod trust;
mod visual_geoms;

pub use contact_filter::ContactFilter;
pub use data::Data;
pub use fetch_model::FetchModel;
pub use ffi::ContactFilterCounts;
pub use ids::{BodyId, GeomId, JointId, SiteId};
pub use library::{MujocoVersion, library_path};
pub use model::Model;
pub use poses::Pose;
#[cfg(feature = "render")]
pub use render::{Camera, FreeCamera, RenderError, RenderOptions, Renderer, Segment};
pub use simulator::{MujocoSimulator, MujocoSnapshot};
pub use visual_geoms::{Shape, VisualGeom};
