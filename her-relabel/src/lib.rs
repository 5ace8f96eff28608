//! Hindsight Experience Replay: a buffer of episodes that relabels goals.
//!
//! An agent that misses its goal has still reached *something*. [`HerBuffer`] stores the episodes
//! of a goal-conditioned task, and [`Sampler`] draws transitions from it. For a share of them, it
//! replaces the desired goal with a goal that was achieved later in the same episode, and the
//! reward with the one for that goal. The crate needs no environment: it works for any task with an
//! achieved and a desired goal, and with any [`GoalReward`](goal_reward::GoalReward).
//!
//! It is not a learner. Sampling takes a few percent of a training step, so a faster buffer does
//! not make a training run much faster.
//!
//! - Episodes are added [step by step](HerBuffer::add_step), as steps of
//!   [several environments at once](HerBuffer::record), or [whole](HerBuffer::add_episode), with
//!   additional [fields](BufferConfig::with_field).
//! - Transitions are drawn uniformly or [by priority](Sampler::with_priorities), singly or in
//!   [windows](Sampler::with_n_step), with goals of any [mixture](GoalMixture) of strategies.
//! - A [batch](Batch) has the element type of the network. On request, observations and goals are
//!   [joined](Sampler::with_joined_goal) and [normalized](Normalizers), and some rows are
//!   [mirrored](Sampler::with_mirrored) or get [moved goals](Sampler::with_goal_noise). Columns can
//!   be [taken](Batch::take_columns) or written into [your own memory](Sampler::sample_into).
//! - A buffer is [saved](HerBuffer::save) and [loaded](HerBuffer::load) with its unfinished
//!   episodes, and continues exactly where it was. The feature `npz` exchanges episodes with numpy.
//! - On Linux, the transitions lie in huge pages if the system provides them, which makes sampling
//!   faster.
//!
//! # Which type do I need?
//! | to | use |
//! |---|---|
//! | store episodes | [`HerBuffer`], created from a [`BufferConfig`] |
//! | add the steps of one environment | [`StartData`], then [`StepData`] |
//! | add the steps of many environments | [`StepRows`], with [`RowNumbers`] |
//! | add a finished episode | [`EpisodeData`] |
//! | draw transitions | [`Sampler`] into a [`Batch`] |
//! | draw into your own memory | [`Sampler::sample_into`] with [`ColumnsMut`] |
//! | choose the new goals | [`GoalStrategy`], or several in a [`GoalMixture`] |
//! | normalize what networks see | [`Normalizer`], as [`Normalizers`] while drawing |
//! | learn from the mirror image as well | [`Sampler::with_mirrored`] and a [`Symmetry`](goal_reward::Symmetry) |
//! | move new goals a little | [`GoalNoise`] |
//! | give a network the same input while acting | [`Normalizers::write_input`] with [`StateRows`] |
//!
//! # Features
//! - `npz`: writes episodes to archives of numpy arrays, and reads such archives and those of
//!   OGBench. Off by default.
//!
//! # Example
//! ```
//! use goal_reward::DistanceReward;
//! use her_relabel::{Batch, BufferConfig, Dims, HerBuffer, StartData, StepData};
//! use her_relabel::{GoalStrategy, Sampler, UnitInterval};
//! use rand_chacha::{ChaCha8Rng, rand_core::SeedableRng};
//!
//! // A point walks along a line for five steps; its goal is far away.
//! let dims = Dims { observation: 1, goal: 1, action: 1 };
//! let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(1000, dims))?;
//! buffer.begin_episode(0, &StartData {
//!     observation: &[0.0],
//!     achieved_goal: &[0.0],
//!     desired_goal: &[100.0],
//! })?;
//! for step in 1..=5_u8 {
//!     let place = f32::from(step);
//!     buffer.add_step(0, &StepData {
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
//! // Four relabeled transitions for each original one.
//! let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
//! let mut batch = Batch::<f32>::new();
//! let mut random = ChaCha8Rng::seed_from_u64(7);
//! for _ in 0..3 {
//!     // A generator gives other rows each time; the same seed would give the same rows.
//!     sampler.sample(&buffer, &DistanceReward::sparse(), &mut random, &mut batch)?;
//!     // Seen in hindsight, some steps reached their goal.
//!     assert!(batch.reward().contains(&0.0));
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

#[macro_use]
mod debug;
#[macro_use]
mod settings;

mod add;
pub mod files;
mod normalize;
mod normalizer;
#[cfg(feature = "npz")]
mod npz;
mod sample;
mod save;
mod scalar;
mod split_mix;
mod store;
mod unit_interval;

/// Crates whose types are part of this crate's interface.
pub use {::goal_reward, ::goal_reward::Dims, ::rand_core};

pub use add::arguments::{
    AsStepRows, EpisodeData, FieldRows, RowNumbers, StartData, StepData, StepRows,
};
pub use add::check::AddError;
pub use add::record::{Recorded, RefusedRow};
pub use normalizer::{Normalizer, NormalizerConfig, NormalizerError};
#[cfg(feature = "npz")]
pub use npz::{array::NpzError, ogbench::GoalColumns};
pub use sample::error::SampleError;
pub use sample::random::RandomSource;
pub use sample::rows::acting::{InputError, StateRows};
pub use sample::rows::batch::{Batch, Columns, ColumnsMut};
pub use sample::settings::goals::{GoalMixture, GoalPart, GoalStrategy, MixtureError};
pub use sample::settings::inputs::{JoinedGoal, Normalizers, Transforms};
pub use sample::settings::n_step::NStep;
pub use sample::settings::noise::GoalNoise;
pub use sample::settings::sampler::Sampler;
pub use sample::settings::termination::Termination;
pub use save::stream::LoadError;
pub use scalar::Scalar;
pub use store::buffer::HerBuffer;
pub use store::config::{BufferConfig, ConfigError};
pub use store::fields::{Field, UnknownField};
pub use store::motionless::MotionlessEpisodes;
pub use store::priorities::{NewPriority, Priorities, PriorityError, PriorityUnit};
pub use store::transition_id::TransitionId;
pub use unit_interval::{UnitInterval, UnitIntervalError};

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
