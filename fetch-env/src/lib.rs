//! The eight Fetch environments, goal-conditioned, with Gymnasium's semantics.
#![forbid(unsafe_code)]

pub mod check;
mod config;
mod env;
mod error;
mod euler;
mod fetch_env;
mod fetch_snapshot;
mod goal_env;
mod np_random;
mod observation;
mod registry;
mod reset;
pub mod spaces;
mod time_limit;

pub use ::fetch_sim::{ModelSource, Task};
pub use config::{ConfigError, FetchConfig, FetchConfigBuilder};
pub use env::{Env, Reset, SnapshotEnv, Step};
pub use error::EnvError;
pub use fetch_env::FetchEnv;
pub use fetch_snapshot::FetchSnapshot;
pub use goal_env::{GoalEnv, GoalObservation, Info};
pub use np_random::NpRandom;
pub use observation::{FetchObservation, ObservationField, observation_fields};
pub use registry::{EnvId, KinematicEnv, UnknownEnvId, make_kinematic};
#[cfg(feature = "mujoco")]
pub use registry::{MujocoEnv, make, make_config};
pub use reset::FetchResetOptions;
pub use spaces::{BoxSpace, DictSpace, Space};
pub use time_limit::{TimeLimit, TimeLimitSnapshot};
