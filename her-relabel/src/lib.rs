//! Hindsight Experience Replay: a buffer of episodes that relabels goals.
//!
//! An agent that fails to reach its goal has still reached *something*. [`HerBuffer`] stores the
//! episodes of a goal-conditioned task, and [`Sampler`] draws transitions from it whose desired goal
//! is replaced, for a share of them, by a goal that was achieved later in the same episode, with the
//! reward that this goal would have given. It needs no environment: any task with an achieved and a
//! desired goal can use it, with any [`GoalReward`](goal_reward::GoalReward).
//!
//! It is not a learner, and sampling is a few per cent of a training step: a faster buffer does not
//! make a training run much faster.
//!
//! - Episodes come [step by step](HerBuffer::add_step), a step of
//!   [all environments at once](HerBuffer::add_steps), or [whole](HerBuffer::add_episode), with
//!   [fields](BufferConfig::with_field) of your own beside the usual ones.
//! - Transitions are drawn uniformly or [by priority](Sampler::with_priorities), alone or in
//!   [windows](Sampler::with_n_step), for goals of any [mixture](GoalMixture).
//! - A buffer is [saved](HerBuffer::save) and [loaded](HerBuffer::load) with its unfinished episodes, and
//!   goes on as if nothing had happened. The feature `npz` exchanges episodes with numpy.
//! - On Linux the transitions lie in huge pages, if the system gives any, which makes sampling faster.
//!
//! # Example
//! ```
//! use goal_reward::DistanceReward;
//! use her_relabel::{Batch, BufferConfig, Dims, EpisodeStart, HerBuffer, Step};
//! use her_relabel::{GoalStrategy, RelabelRatio, Sampler};
//!
//! // A point walks along a line for five steps; its goal is far away.
//! let dims = Dims { observation: 1, goal: 1, action: 1 };
//! let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(1000, dims))?;
//! buffer.begin_episode(0, &EpisodeStart {
//!     observation: &[0.0],
//!     achieved_goal: &[0.0],
//!     desired_goal: &[100.0],
//! })?;
//! for step in 1..=5_u8 {
//!     let place = f32::from(step);
//!     buffer.add_step(0, &Step {
//!         action: &[1.0],
//!         reward: -1.0,
//!         next_observation: &[place],
//!         next_achieved_goal: &[place],
//!         terminated: false,
//!         truncated: step == 5,
//!         fields: &[],
//!     })?;
//! }
//!
//! // Four relabeled transitions for each that is left alone.
//! let sampler = Sampler::new(256, GoalStrategy::Future, RelabelRatio::from_k(4));
//! let mut batch = Batch::new();
//! sampler.sample_seeded(&buffer, &DistanceReward::sparse(), 7, &mut batch)?;
//! // Seen in hindsight, some steps reached their goal.
//! assert!(batch.reward().contains(&0.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]

mod add;
mod normalizer;
#[cfg(feature = "npz")]
mod npz;
mod sample;
mod save;
mod scalar;
mod store;

pub use add::arguments::{AddError, EpisodeData, EpisodeStart, Step};
pub use add::vectorized::{StartBatch, StepBatch};
pub use normalizer::{Normalizer, NormalizerError};
#[cfg(feature = "npz")]
pub use npz::NpzError;
pub use sample::batch::Batch;
pub use sample::error::SampleError;
pub use sample::goals::{GoalStrategy, RatioError, RelabelRatio};
pub use sample::importance::{Beta, BetaError};
pub use sample::mixture::{GoalMixture, GoalPart, MixtureError};
pub use sample::n_step::{Discount, DiscountError};
pub use sample::sampler::{NStep, Sampler};
pub use save::load_error::LoadError;
pub use scalar::Scalar;
pub use store::buffer::HerBuffer;
pub use store::config::{BufferConfig, ConfigError, Dims};
pub use store::fields::{Field, FieldRows, UnknownField};
pub use store::priority_table::{NewPriority, Priorities, PriorityError, PriorityUnit};
pub use store::storage::TransitionId;
