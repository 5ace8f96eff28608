//! The eight goal-conditioned Fetch environments of gymnasium-robotics 1.4.2, written in Rust.
//!
//! A [`FetchEnv`] consists of settings, a simulator, a reward and a task. The traits say what an
//! environment does: [`Env`] resets and steps, [`GoalEnv`] derives rewards from goals,
//! [`SnapshotEnv`] saves and restores its state. [`TimeLimit`] ends its episodes. The semantics are
//! Gymnasium's, with typed errors instead of exceptions and silent misbehavior. [`check`] tests
//! whether an environment, from this crate or not, keeps the laws that its users rely on.
//!
//! [`wrappers`] change what an environment takes or returns: `RecordEpisodeStatistics`,
//! `FlattenObservation`, `NormalizeObservation` and others. A [`Registry`] makes environments by
//! name, including a user's own. [`vec_env`] steps many at once. [`spaces`] describe actions and
//! observations, both numbers and choices, and draw samples.
//!
//! ```
//! use fetch_env::{Env, GoalEnvExt, GoalObservation, make_kinematic};
//!
//! // `make` does the same on MuJoCo; the kinematic simulator needs no library.
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
//!     // The law on which hindsight relabeling relies.
//!     let next = &step.observation;
//!     let (achieved, desired) = (next.achieved_goal(), next.desired_goal());
//!     assert_eq!(step.reward, env.compute_reward(achieved, desired)?);
//!     if step.is_last() {
//!         assert!(step.truncated && !step.terminated && step.info.is_success);
//!         break;
//!     }
//!     observation = step.observation;
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # Which type do I need?
//! | to | use |
//! |---|---|
//! | make a Fetch environment by its id | `make`, or [`make_kinematic`] without MuJoCo |
//! | change its settings | [`FetchConfig`], made from an [`EnvId`]; pass it to `make` |
//! | randomize its physics and looks, or add noise and delay | [`variation::Variation`], set by [`FetchConfig::with_variation`] |
//! | change its reward, its goals, or what it observes | [`FetchEnv::with_goal_reward`], [`FetchTask`] |
//! | reset and step any environment | [`Env`] |
//! | compute the reward of any pair of goals | [`GoalEnv`], [`GoalEnvExt`] |
//! | save and restore its state | [`SnapshotEnv`] |
//! | move the goal within an episode | [`MovingGoal`] |
//! | change what it takes or returns | [`EnvExt::wrap`] with one of the [`wrappers`] |
//! | step many at once | [`VecEnv`], from `make_vec` or [`make_kinematic_vec`] |
//! | make environments of your own by name | [`Registry`] |
//! | test an environment of your own | [`check`] |
//! | see it | `RenderEnv`, `View`; `PixelOptions` for observations; `RecordVideo` for files |
//!
//! # Seeds
//! `reset(Some(seed))` restarts the random numbers as numpy's `PCG64(SeedSequence(seed))`: the same
//! seed gives the same goals and object positions as in Python. `reset(None)` continues them. Draw
//! a policy's random numbers from a different generator: one with the same seed would repeat the
//! numbers from which the goal was drawn.
//!
//! # Features
//! - `mujoco` (default): `make`, on MuJoCo. Everything else works without it and needs no library.
//! - `render` (default): `RenderEnv` and observations with pictures. The first renderer loads
//!   OpenGL; building does not need it.
//! - `clip`: GIF, APNG and PNG files of rendered frames; with `render` also `RecordVideo`.
//! - `her-relabel`: lets `her_relabel::HerBuffer::record` take a [`VecStep`](vec_env::VecStep).
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

#[macro_use]
mod debug;
#[macro_use]
mod settings;

mod fetch;
mod gym;
#[cfg(any(feature = "clip", feature = "render"))]
mod pictures;
#[cfg(feature = "mujoco")]
mod shared;

/// Domain randomization: factors, such as the object's mass, that are drawn for each episode.
pub mod variation {
    pub use crate::fetch::variation::{
        Variation, Varied, draw::Draw, error::VariationError, factor::Factor,
        interface::InterfaceFactor,
    };
    pub use fetch_sim::{LookFactor, Looks, Physics, PhysicsFactor};
}

#[doc = include_str!("../FIDELITY.md")]
pub mod fidelity {}

#[doc = include_str!("../PROMISES.md")]
pub mod promises {}

/// Crates whose types are part of this crate's interface.
pub use {::fetch_sim, ::goal_reward, ::rand_core};

#[cfg(feature = "her-relabel")]
pub use ::her_relabel;

#[cfg(feature = "render")]
pub use ::fetch_sim::{Camera, FreeCamera, RenderError, RenderOptions, Renderer, Segment};
pub use ::fetch_sim::{
    Extension, KinematicSimulator, ModelFiles, ModelSource, ObjectShape, SimConfig, SimError,
    Simulator, Task,
};
#[cfg(feature = "mujoco")]
pub use ::fetch_sim::{MujocoSimulator, builtin_files};
pub use ::goal_reward::{
    Dims, DistanceReward, DistanceThreshold, GoalError, GoalPairs, GoalReward, RewardKind,
    Symmetry, ThresholdError,
};
#[cfg(feature = "mujoco")]
pub use fetch::make::{MujocoEnv, make, make_vec, make_vec_while};
pub use fetch::{
    config::FetchConfig,
    env::FetchEnv,
    env_id::EnvId,
    error::{MakeError, StartError},
    kinematic::{KinematicEnv, make_kinematic, make_kinematic_vec},
    layout::{ObservationField, observation_fields},
    observation::FetchObservation,
    reset::FetchResetOptions,
    snapshot::FetchSnapshot,
    task::FetchTask,
};
pub use gym::{
    check,
    env::{
        ActionElement, Env, Reset, SnapshotEnv, Step, WrappedSnapshot,
        action_space::ActionSpace,
        goal::{GoalEnv, GoalEnvExt, Info, MovingGoal},
        observation::{BatchObservation, GoalObservation},
    },
    error::EnvError,
    np_random::NpRandom,
    registry::{Registry, RegistryError},
    spaces::{
        self, BoxSpace, DictSpace, DiscreteSpace, MultiBinarySpace, MultiDiscreteSpace, Space,
    },
    vec_env::{self, VecEnv},
    wrappers::{self, EnvExt, TimeLimit},
};
#[cfg(feature = "clip")]
pub use pictures::clip;
#[cfg(all(feature = "clip", feature = "render"))]
pub use pictures::clip::record_video::{RecordVideo, VideoFormat};
#[cfg(feature = "render")]
pub use pictures::{
    frames::PixelOptions,
    observations::{PictureRows, PixelObservation, PixelRows, Pixels},
    pixels::{AddRenderObservation, PixelsOnly},
    render::RenderEnv,
    view::View,
};

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
