//! Baselines for the Fetch tasks: policies, their evaluation, and learning.
//!
//! A trained agent must beat [`RandomPolicy`]; [`ScriptedPolicy`] shows how far a few rules go, and
//! a [`TrainedPolicy`] is loaded from a file. The module `learn` (feature `learn`) trains them.
//! [`evaluate`] runs a policy over many seeded episodes, and [`Evaluation::summary`] returns
//! success rate, mean return, episode length, final distance and the figures of a controller, each
//! with its 95 % confidence interval. [`collect`] adds episodes to a hindsight replay buffer. The
//! module `page` (feature `page`) turns episodes into a self-contained HTML page that plays them
//! back.
//!
//! # Which type do I need?
//! | to | use |
//! |---|---|
//! | act | a [`Policy`]: [`RandomPolicy`], [`ZeroPolicy`], [`ProportionalPolicy`], [`ScriptedPolicy`], [`TrainedPolicy`] |
//! | act on pictures | a `PixelPolicy`; an [`AnyPolicy`] is loaded from a file of either kind |
//! | act in many environments at once | a [`VecPolicy`] |
//! | know how much of a task can be solved | a [`Planner`], which knows the simulator |
//! | measure a policy | [`evaluate`], or [`evaluate_vec`] on many environments |
//! | fill a replay buffer | [`collect`], or a [`Collector`] of many environments |
//! | write a data set for Minari or OGBench | a `datasets::DatasetWriter` |
//! | read a Minari data set | `datasets::import_minari` |
//! | train a policy | `learn::Trainer` |
//! | make a network of any teacher, on the state or on pictures | `learn::Distiller`, in a folder `runs::NewStudent` |
//! | learn from pictures without a teacher | `learn::Trainer::with_pixels`, in a folder `runs::NewStudent` |
//! | train with your own algorithm | `learn::Algorithm` |
//! | train in a folder, resume, run grids | `runs::RunPlan` |
//! | compare two samples | a test of [`statistics`] |
//! | share a run between processes | [`workers`] |
//!
//! # Features
//! - `mujoco`, `render` (default): the environments on MuJoCo, and their pictures.
//! - `learn`: the module `learn`.
//! - `minari`, `ogbench`: the module `datasets`, with a writer of each format, and
//!   Minari's reader.
//! - `page`: the module `page`.
//! - `runs`: the module `runs`; with `page`, each run writes a page.
//! - `mpi`: `workers::MpiWorkers`, the processes that `mpirun` starts.
#![forbid(unsafe_code)]
#![cfg_attr(docsrs, feature(doc_cfg))]

#[macro_use]
mod debug;

mod across_workers;
#[cfg(any(feature = "learn", feature = "ogbench"))]
mod archive;
mod collect;
mod collector;
#[cfg(feature = "datasets")]
pub mod datasets;
mod dims;
mod evaluate;
#[cfg(feature = "learn")]
pub mod learn;
#[cfg(feature = "learn")]
pub mod network;
#[cfg(any(feature = "datasets", feature = "learn"))]
mod normal;
#[cfg(feature = "mujoco")]
mod on_mujoco;
#[cfg(feature = "page")]
pub mod page;
mod planned;
mod policy;
#[cfg(feature = "learn")]
mod reset_seeds;
pub mod robustness;
#[cfg(feature = "runs")]
pub mod runs;
mod scripted;
pub mod statistics;
mod tanh;
mod trained;
pub mod workers;

pub use across_workers::{evaluate_across_workers, gather_episodes};
pub use collect::{CollectError, buffer_config, collect};
pub use collector::{CollectEnv, Collected, Collector, CollectorError, CollectorSnapshot};
pub use evaluate::{
    ControlSummary, Controls, Episode, Evaluation, EvaluationError, Summary, evaluate,
    evaluate_vec, evaluate_vec_while, strata_of, stratum,
};
#[cfg(feature = "mujoco")]
pub use on_mujoco::OnMujoco;
pub use planned::{Plan, PlanEnv, PlannedPolicy, Planner, PlannerError, PlannerSettings};
pub use policy::{Action, Policy, PolicyError, RandomPolicy, VecPolicy, ZeroPolicy};
pub use scripted::{ProportionalPolicy, ScriptedPolicy};
pub use statistics::{Estimate, StatisticsError};
pub use trained::{
    AnyPolicy, InputPart, LayerWeights, PolicyHeader, SuccessRate, TrainedPolicy,
    TrainedPolicyError,
};
#[cfg(all(feature = "learn", feature = "render"))]
pub use trained::{PixelPolicy, SeenField, Sight};

/// The README's example, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
