//! The environments of runs.

#[cfg(feature = "render")]
use fetch_env::{AddRenderObservation, EnvExt, PixelOptions, wrappers::Wrapped};
use fetch_env::{EnvError, FetchConfig, MakeError, MujocoEnv, SnapshotEnv, make};

use crate::learn::LearnEnv;

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

/// Returns a function that makes the environments of one run with pictures.
#[cfg(feature = "render")]
pub(super) fn maker_with_pictures<E: RunEnv>(
    make: impl Fn() -> Result<E, EnvError>,
    pixels: PixelOptions,
) -> impl Fn() -> Result<Wrapped<E, AddRenderObservation>, EnvError> {
    move || make()?.wrap(AddRenderObservation::new(pixels.clone()))
}

/// An environment that runs learn, save and, with the features `page` and `render`, play back and
/// draw. Every environment with these traits is one.
pub trait RunEnv: LearnEnv + SnapshotEnv + Played + Drawn {}

impl<E: LearnEnv + SnapshotEnv + Played + Drawn> RunEnv for E {}

/// Implements a trait that is another one with a feature, and nothing without it.
macro_rules! with_feature {
    ($feature:literal, $name:ident, $other:path) => {
        #[doc = concat!("[`", stringify!($other), "`] with the feature `", $feature, "`.")]
        #[cfg(feature = $feature)]
        pub trait $name: $other {}

        #[cfg(feature = $feature)]
        impl<E: $other> $name for E {}

        #[doc = concat!("Any environment, without the feature `", $feature, "`.")]
        #[cfg(not(feature = $feature))]
        pub trait $name {}

        #[cfg(not(feature = $feature))]
        impl<E> $name for E {}
    };
}

with_feature!("page", Played, crate::page::PlaybackEnv);
with_feature!("render", Drawn, fetch_env::RenderEnv);
