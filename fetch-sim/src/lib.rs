//! The Fetch robot on MuJoCo.

mod error;
mod simulator;
mod task;

pub use error::SimError;
pub use simulator::{Control, GripperState, ObjectState, Settled, Simulator};
pub use task::Task;
