//! Learning with hindsight: algorithms, their settings, and the loop that trains.

mod actor;
mod adam;
mod algorithm;
mod checkpoint;
mod ddpg;
mod error;
mod explorer;
mod network;
mod pass;
mod sac;
mod settings;
mod trainer;

pub use actor::Actor;
pub use algorithm::{Algorithm, Losses, PARTS, StateMut};
pub use ddpg::{Ddpg, DdpgSettings};
pub use error::{CheckpointError, TrainError};
pub use sac::{Sac, SacSettings};
pub use settings::{
    AlgorithmSettings, ExplorationSettings, ReplaySettings, ScheduleSettings, TrainSettings,
};
pub use trainer::{Counters, CurveRow, LearnEnv, Target, Trainer};
