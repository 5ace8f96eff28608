//! Baselines for the Fetch tasks: policies, their evaluation, and learning.
//!
//! A trained agent must beat [`RandomPolicy`]; [`ScriptedPolicy`] shows how far a few rules go, and
//! a [`TrainedPolicy`] is loaded from a file. The module `learn` (feature `learn`) trains them.
//! [`evaluate`] runs a policy over many seeded episodes, and [`Evaluation::summary`] returns
//! success rate, mean return, episode length and final distance, each with its 95 % confidence
//! interval. [`collect`] adds episodes to a hindsight replay buffer. The module `page` (feature
//! `page`) turns episodes into a self-contained HTML page that plays them back.
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

mod collect;
mod collector;
mod error;
mod evaluate;
#[cfg(feature = "learn")]
pub mod learn;
#[cfg(feature = "page")]
pub mod page;
mod policy;
mod scripted;
mod spread;
mod statistics;
mod trained;
pub mod workers;

pub use collect::{buffer_config, collect};
pub use collector::{CollectEnv, Collected, Collector, CollectorSnapshot};
pub use error::{CollectError, CollectorError, EvaluationError};
pub use evaluate::{Episode, Evaluation, Summary, evaluate, evaluate_vec};
pub use policy::{Action, Policy, RandomPolicy, ZeroPolicy};
pub use scripted::ScriptedPolicy;
pub use spread::{evaluate_spread, gather_episodes};
pub use statistics::{Estimate, StatisticsError};
pub use trained::{
    InputPart, LayerWeights, PolicyHeader, SuccessRate, TrainedPolicy, TrainedPolicyError,
};

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
