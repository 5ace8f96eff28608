//! The MuJoCo implementation of [`Simulator`](crate::Simulator), and the safe binding below it.

mod binding;
#[cfg(feature = "render")]
mod render;
mod robot;

pub use binding::{
    contact_filter::ContactFilter,
    data::Data,
    ffi::ContactFilterCounts,
    ids::{BodyId, GeomId, JointId, SiteId},
    library::{brings_library, library_path, use_library},
    model::Model,
    poses::Pose,
    version::MujocoVersion,
};
#[cfg(feature = "render")]
pub use render::{Camera, FreeCamera, RenderError, RenderOptions, Renderer, Segment};
pub use robot::{
    data_mut::DataMut,
    fetch_model::FetchModel,
    scene::{builtin_files, scene_files},
    simulator::MujocoSimulator,
    snapshot::MujocoSnapshot,
    visual_geoms::{Shape, VisualGeom},
};
