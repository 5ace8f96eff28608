//! Baselines for the Fetch tasks: policies that do not learn, and what they achieve.
//!
//! A trained agent must beat [`RandomPolicy`]; [`ScriptedPolicy`] shows what a few rules reach.
//! [`evaluate`] runs either over many seeded episodes, and [`Evaluation::summary`] gives success
//! rate, mean return, episode length and final distance, each with its 95 % interval. [`collect`] fills a hindsight
//! replay buffer with their episodes.
#![forbid(unsafe_code)]

mod collect;
mod error;
mod evaluate;
mod policy;
mod random;
mod reference;
mod scripted;
mod statistics;
mod zero;

pub use collect::{buffer_config, collect};
pub use error::{CollectError, EvaluationError};
pub use evaluate::{Episode, Evaluation, Summary, evaluate};
pub use policy::{Action, Policy};
pub use random::RandomPolicy;
pub use reference::{Comparison, RandomReference, Sample, ScriptedReference};
pub use scripted::ScriptedPolicy;
pub use statistics::{Estimate, chi_square, fisher_exact, kolmogorov_smirnov};
pub use zero::ZeroPolicy;
