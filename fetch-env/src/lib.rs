//! The eight Fetch environments of gymnasium-robotics 1.4.2, goal-conditioned, native in Rust.
//!
//! A [`FetchEnv`] is a configuration, a simulator and a reward. [`Env`] says what can be done with
//! it, [`GoalEnv`] what its goals and rewards have to do with each other, [`SnapshotEnv`] that its
//! state can be kept; [`TimeLimit`] ends its episodes. The semantics are Gymnasium's, with typed
//! errors in place of exceptions and of silence. [`check`] tests whether an environment, also one
//! that is not from here, keeps the laws that its users rely upon.
//!
//! ```
//! use fetch_env::{Env, GoalEnv, GoalObservation, make_kinematic};
//!
//! // `make` is the same on MuJoCo; this is a stand-in for the physics that needs no library.
//! let mut env = make_kinematic("FetchReachDense-v4")?;
//! let mut observation = env.reset(Some(42))?.observation;
//! loop {
//!     // Straight to the goal; one unit of an action is 5 cm.
//!     let mut action = [0.0; 4];
//!     for axis in 0..3 {
//!         let distance = observation.desired_goal()[axis] - observation.achieved_goal()[axis];
//!         action[axis] = (distance / 0.05) as f32;
//!     }
//!     let step = env.step(&action)?;
//!     observation = step.observation;
//!     // The law that hindsight relabeling lives by.
//!     let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
//!     assert_eq!(step.reward, env.compute_reward(achieved, desired)?);
//!     if step.is_last() {
//!         assert!(step.truncated && !step.terminated && step.info.is_success);
//!         break;
//!     }
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Seeds
//! `reset(Some(seed))` starts the random numbers anew, as numpy's `PCG64(SeedSequence(seed))`: the
//! same seed gives the same goals and places as in Python. `reset(None)` goes on with them. Take a
//! policy's random numbers from another generator: from one with the same seed they would be those
//! that the goal was drawn from.
//!
//! # Features
//! - `mujoco` (default): `make`, on MuJoCo. Without it everything else is there, and no library is
//!   needed.
//! - `render` (default): `RenderEnv` and observations of pixels. OpenGL is loaded when the first
//!   renderer is made, and is not needed to build.
//! - `clip`: GIF, APNG and PNG of what was rendered.
#![forbid(unsafe_code)]

pub mod check;
#[cfg(feature = "clip")]
pub mod clip;
mod env;
mod error;
mod fetch;
mod np_random;
#[cfg(feature = "render")]
mod render;
pub mod spaces;
pub mod vec_env;

#[doc = include_str!("../DIFFERENCES.md")]
pub mod differences {}

#[cfg(feature = "render")]
pub use ::fetch_sim::{Camera, FreeCamera, RenderError, RenderOptions, Renderer, Segment};
pub use ::fetch_sim::{ModelSource, Task};
pub use env::{
    Env, Reset, SnapshotEnv, Step,
    goal::{GoalEnv, GoalObservation, Info},
    time_limit::{TimeLimit, TimeLimitSnapshot},
};
pub use error::EnvError;
pub use fetch::{
    config::{ConfigError, FetchConfig, FetchConfigBuilder},
    env::FetchEnv,
    make::{EnvId, KinematicEnv, UnknownEnvId, make_kinematic},
    observation::{FetchObservation, ObservationField, observation_fields},
    reset::FetchResetOptions,
    snapshot::FetchSnapshot,
};
#[cfg(feature = "mujoco")]
pub use fetch::{
    make::{MujocoEnv, make, make_config},
    make_vec::{make_vec, make_vec_config},
};
pub use np_random::NpRandom;
#[cfg(feature = "render")]
pub use render::{
    RenderEnv,
    pixels::{AddRenderObservation, ChannelOrder, PixelObservation, PixelOptions, Pixels},
};
pub use spaces::{BoxSpace, DictSpace, Space};
pub use vec_env::VecEnv;

/// The README's example, run as a test.
#[cfg(all(doctest, feature = "render"))]
#[doc = include_str!("../../README.md")]
struct Readme;
