//! border-core's traits: a Fetch environment as its `Env`, and a prioritized hindsight buffer as
//! its replay buffer, so that its trainer and its agents work with both.

mod env;
mod replay;

pub use env::{Config, FetchAct, FetchObs, GoalEnvironment, Success};
pub use replay::{HerBatch, HerReplay, HerReplayConfig, HerStep, HerSteps, Matrix};
