//! A run: what collects, what holds and draws, what updates, and the loop over them.

pub(crate) mod collecting;
pub(crate) mod curve;
mod cycle;
pub(crate) mod demonstrated;
mod diagnostics;
pub(crate) mod env;
pub(crate) mod evaluation;
pub(crate) mod explorer;
pub(crate) mod eyes;
mod far_starts;
pub(crate) mod inputs;
mod last_cycle;
pub(crate) mod learner;
mod offline;
mod replay;
pub(crate) mod seeds;
mod start;
mod stricter;
pub(crate) mod trainer;
mod training_loop;
pub(crate) mod updates;
