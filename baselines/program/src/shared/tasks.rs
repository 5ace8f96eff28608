//! What makes the environments of a command.

use baselines::{OnMujoco, runs::MakeEnvs};

/// Makes Fetch environments on MuJoCo: of the built-in tasks, or of the host's own. Everything that does
/// implements this trait.
pub trait Tasks: MakeEnvs<Env: OnMujoco> {}

impl<M: MakeEnvs<Env: OnMujoco>> Tasks for M {}
