//! Observations that are pictures alone.

use super::frames::{Pictures, PixelOptions, snapshot_pictures};
use super::render::RenderEnv;
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::Space;
use crate::gym::wrappers::{
    array::SharedArray,
    macros::keep,
    wrapper::{Resetting, Wrapper},
};

/// Observes pictures of the environment and nothing else.
///
/// It is [`AddRenderObservation`](crate::AddRenderObservation) without the state, for policies that
/// only see: a [`VecStep`](crate::vec_env::VecStep) of many has one row of bytes for each
/// environment.
///
/// ```
/// use fetch_env::vec_env::{VecConfig, VecEnv};
/// use fetch_env::{EnvExt, PixelOptions, PixelsOnly, make};
///
/// let pixels = || PixelsOnly::new(PixelOptions::default());
/// let env = || make("FetchPickAndPlace-v4")?.wrap(pixels());
/// if let Ok(envs) = (0..4).map(|_| env()).collect::<Result<Vec<_>, _>>() {
///     let mut envs = VecEnv::new(envs, VecConfig::default())?;
///     assert_eq!(envs.reset(Some(0))?.pixels().len(), 4 * 84 * 84 * 3);
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Debug)]
pub struct PixelsOnly {
    pictures: Pictures,
    /// `None` without an environment.
    observation_space: Option<Space>,
}

impl PixelsOnly {
    /// Observes pictures as `options` describe them.
    ///
    /// [`wrap`](crate::EnvExt::wrap) returns a [`RenderError`](fetch_sim::RenderError) without
    /// OpenGL and for invalid options, and
    /// [`SpaceError::TooLarge`](crate::spaces::SpaceError::TooLarge) if the pictures have more than
    /// 2^28 bytes.
    #[must_use]
    pub fn new(options: PixelOptions) -> Self {
        Self { pictures: Pictures::new(options), observation_space: None }
    }
}

impl<E: RenderEnv> Wrapper<E> for PixelsOnly {
    type Observation = SharedArray<u8>;
    keep!(Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.observation_space = Some(self.pictures.attach(env)?.into());
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<SharedArray<u8>, E::Info>, EnvError> {
        env.reset_with(seed, options)?.try_map_observation(|_| self.pictures.first(&**env))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<SharedArray<u8>, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|_| self.pictures.next(env))
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }
}

snapshot_pictures!(PixelsOnly);
