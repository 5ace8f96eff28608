//! Wrappers change what an environment takes or returns.
//!
//! [`env.wrap(wrapper)`](EnvExt::wrap) puts an environment into a wrapper:
//!
//! | wrapper | does | stays a [`GoalEnv`](crate::GoalEnv) |
//! |---|---|---|
//! | [`TimeLimit`] | truncates episodes after a number of steps | yes |
//! | [`RecordEpisodeStatistics`] | adds return and length of each episode to its last info | yes |
//! | [`FlattenObservation`] | turns a goal-conditioned observation into a vector of `f32` | no |
//! | [`FilterObservation`] | keeps some elements of the observed vector | yes |
//! | [`NormalizeObservation`] | brings the observed vector to mean 0 and variance 1 | yes |
//! | [`TimeAwareObservation`] | appends the time to the observed vector | yes |
//! | [`FrameStack`] | stacks the last observed vectors | yes |
//! | [`TransformObservation`] | applies a function to observations | no |
//! | [`TransformReward`] | applies a function to rewards | yes, made by `with_goal_reward` |
//! | [`RescaleAction`] | takes actions between other bounds | yes |
//! | [`ClipAction`] | clips actions to the action space | yes |
//! | [`ActionRepeat`] | takes each action several times | no |
//! | [`ScaleAction`], [`LowPassAction`] | multiplies or smooths actions | yes |
//! | [`ActionNoise`], [`ObservationNoise`] | adds normal noise | yes |
//! | [`DelayAction`], [`DelayObservation`] | delays by some steps | yes |
//!
//! With the feature `render` there are `AddRenderObservation` and `PixelsOnly`, and with `clip`
//! `RecordVideo`, at the root of the crate. [`Wrapper`] shows how to write your own.
//!
//! [`TimeLimit`], [`RecordEpisodeStatistics`], [`TransformReward`] and `RecordVideo` keep the
//! environment's [symmetries](crate::GoalEnv::symmetries).
//!
//! A [`Wrapped`] environment is an [`Env`](crate::Env) with the reset options of the inner one. It
//! is a [`SnapshotEnv`](crate::SnapshotEnv) and a `RenderEnv` if the inner one is, and can be
//! wrapped again. After a failure that leaves it between two states it refuses steps until the next
//! reset.
//!
//! ```
//! use fetch_env::{Env, EnvExt, VecEnv, make_kinematic, vec_env::VecConfig};
//! use fetch_env::wrappers::{FlattenObservation, NormalizeObservation, RecordEpisodeStatistics};
//!
//! // Four environments for PPO: vectors of `f32`, normalized, and the returns of their episodes.
//! let env = || {
//!     make_kinematic("FetchReachDense-v4")?
//!         .wrap(RecordEpisodeStatistics::new())?
//!         .wrap(FlattenObservation::new())?
//!         .wrap(NormalizeObservation::new())
//! };
//! let envs = (0..4).map(|_| env()).collect::<Result<Vec<_>, _>>()?;
//! let mut envs = VecEnv::new(envs, VecConfig::default())?;
//! envs.reset(Some(42))?;
//! for _ in 0..50 {
//!     assert_eq!(envs.step(&[0.1; 4 * 4])?.array().len(), 4 * 13);
//! }
//! let last = envs.step(&[0.1; 4 * 4])?;
//! assert!(last.started().iter().all(|&started| started));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod action;
pub(crate) mod array;
mod changed_action;
mod changed_vector;
mod filter;
mod flatten;
mod frame_stack;
pub(crate) mod macros;
mod noise;
mod normalize;
mod statistics;
mod time_aware;
mod time_limit;
mod transform;
mod vector;
pub(crate) mod wrapped;
pub(crate) mod wrapper;

pub use self::{
    action::{ActionRepeat, ClipAction, RescaleAction},
    array::SharedArray,
    changed_action::{ChangedAction, DelayAction, LowPassAction, ScaleAction},
    changed_vector::ChangedVector,
    filter::FilterObservation,
    flatten::FlattenObservation,
    frame_stack::{DelayObservation, FrameStack},
    noise::{ActionNoise, ObservationNoise},
    normalize::{NormalizeObservation, RunningStatistics},
    statistics::{EpisodeInfo, EpisodeStatistics, RecordEpisodeStatistics},
    time_aware::TimeAwareObservation,
    time_limit::TimeLimit,
    transform::{TransformObservation, TransformReward},
    vector::{GoalVector, VectorObservation},
    wrapped::{EnvExt, Wrapped},
    wrapper::{GoalWrapper, KeepsGoals, Resetting, SnapshotWrapper, Stateless, Wrapper},
};
