//! The Fetch robot on MuJoCo.

mod config;
mod error;
mod kinematic;
mod simulator;
mod task;

pub use config::SimConfig;
pub use error::SimError;
pub use kinematic::KinematicSimulator;
pub use simulator::{Control, GripperState, ObjectState, Settled, Simulator};
pub use task::Task;
