//! The Fetch robot on MuJoCo.

mod assets;
mod config;
mod error;
mod kinematic;
#[cfg(feature = "mujoco")]
mod mujoco;
mod simulator;
mod task;

pub use assets::{ModelSource, reference_folder};
pub use config::SimConfig;
pub use error::SimError;
pub use kinematic::KinematicSimulator;
#[cfg(feature = "mujoco")]
pub use mujoco::{
    BodyId, Data, FetchModel, GeomId, JointId, Model, MujocoSimulator, MujocoSnapshot,
    MujocoVersion, SiteId,
};
pub use simulator::{Control, GripperState, ObjectState, Settled, Simulator};
pub use task::Task;
