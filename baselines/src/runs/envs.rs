//! The environments of runs.

use fetch_env::{EnvError, FetchConfig, MakeError, MujocoEnv, SnapshotEnv, make};

use crate::learn::LearnEnv;
#[cfg(feature = "page")]
use crate::page::PlaybackEnv;

/// What makes the environments of a run: [`BuiltInTasks`], or a type of your own for your own tasks.
pub trait MakeEnvs: Sync {
    /// The environment.
    type Env: RunEnv + Send + 'static;

    /// Returns the name of a task that is not built in, which the
    /// [description](super::RunDescription) of a run has: a run goes on with the same task alone.
    fn task(&self) -> Option<&str>;

    /// Makes an environment with the settings of a run.
    ///
    /// # Errors
    /// [`MakeError`] if the settings or the model cannot be used.
    fn make(&self, config: FetchConfig) -> Result<Self::Env, MakeError>;
}

/// The four tasks that are built in.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuiltInTasks;

impl MakeEnvs for BuiltInTasks {
    type Env = MujocoEnv;

    fn task(&self) -> Option<&str> {
        None
    }

    fn make(&self, config: FetchConfig) -> Result<MujocoEnv, MakeError> {
        make(config)
    }
}

/// Returns a function that makes the environments of one run.
pub(super) fn maker<M: MakeEnvs>(
    tasks: &M,
    config: FetchConfig,
) -> impl Fn() -> Result<M::Env, EnvError> {
    move || Ok(tasks.make(config.clone())?)
}

/// An environment that runs learn, save and, with the feature `page`, play back. Every environment
/// with these traits is one.
#[cfg(feature = "page")]
pub trait RunEnv: LearnEnv + SnapshotEnv + PlaybackEnv {}

#[cfg(feature = "page")]
impl<E: LearnEnv + SnapshotEnv + PlaybackEnv> RunEnv for E {}

/// An environment that runs learn and save. Every environment with these traits is one.
#[cfg(not(feature = "page"))]
pub trait RunEnv: LearnEnv + SnapshotEnv {}

#[cfg(not(feature = "page"))]
impl<E: LearnEnv + SnapshotEnv> RunEnv for E {}
