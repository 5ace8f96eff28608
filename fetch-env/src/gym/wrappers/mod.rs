//! Wrappers: environments that change what another environment takes or returns.
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
//! | [`TransformReward`] | applies a function to rewards | yes, made by `with_goals` |
//! | [`RescaleAction`] | takes actions between other bounds | yes |
//! | [`ClipAction`] | clips actions to the action space | yes |
//! | [`ActionRepeat`] | takes each action several times | no |
//!
//! A wrapped environment is an [`Env`](crate::Env) with the reset options of the inner one. It is a
//! [`SnapshotEnv`](crate::SnapshotEnv) and a `RenderEnv` if that is, and can be wrapped again. Except
//! for the time limit all of them are [`Wrapped`] environments; [`Wrapper`] shows how to write one.
//!
//! ```
//! use fetch_env::{Env, VecEnv, make_kinematic, vec_env::VecConfig};
//! use fetch_env::wrappers::{FlattenObservation, NormalizeObservation, RecordEpisodeStatistics};
//!
//! // Four environments for PPO: vectors of `f32`, normalized, and the returns of their episodes.
//! let env = || {
//!     let env = RecordEpisodeStatistics::new(make_kinematic("FetchReachDense-v4")?);
//!     NormalizeObservation::new(FlattenObservation::new(env)?)
//! };
//! let envs = (0..4).map(|_| env()).collect::<Result<Vec<_>, _>>()?;
//! let mut envs = VecEnv::new(envs, VecConfig::default())?;
//! envs.reset(Some(42))?;
//! for _ in 0..50 {
//!     assert_eq!(envs.step(&[0.1; 4 * 4])?.array().len(), 4 * 13);
//! }
//! let batch = envs.step(&[0.1; 4 * 4])?;
//! assert!(batch.started().iter().all(|&started| started));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod action;
mod array;
pub(crate) mod error;
mod filter;
mod flatten;
mod frame_stack;
pub(crate) mod macros;
mod normalize;
mod statistics;
mod time_aware;
pub(crate) mod time_limit;
mod transform;
mod vector;
pub(crate) mod wrapped;

pub use self::{
    action::{ActionRepeat, Clip, ClipAction, Repeat, Rescale, RescaleAction},
    array::{ArrayPool, SharedArray},
    error::WrapperError,
    filter::{Filter, FilterObservation},
    flatten::{Flatten, FlattenObservation},
    frame_stack::{FrameStack, Stack},
    normalize::{Normalize, NormalizeObservation, NormalizeState, RunningStatistics},
    statistics::{EpisodeInfo, EpisodeRecorder, EpisodeStatistics, RecordEpisodeStatistics},
    time_aware::{TimeAware, TimeAwareObservation},
    time_limit::{TimeLimit, TimeLimitSnapshot},
    transform::{ObservationTransform, TransformObservation, TransformReward, TransformedReward},
    vector::{GoalVector, VectorElement, VectorObservation},
    wrapped::{
        GoalWrapper, KeepsGoals, Resetting, SnapshotWrapper, Stateless, Wrapped, WrappedSnapshot,
        Wrapper,
    },
};
