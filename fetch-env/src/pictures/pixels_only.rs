//! Observations that are pictures alone.

use super::frames::{Pictures, PixelOptions, Pixels, snapshot_pictures};
use super::render::RenderEnv;
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::{ImageSpace, Space};
use crate::gym::wrappers::{
    macros::keep,
    wrapped::{Resetting, Wrapped, Wrapper},
};

/// An environment whose observations are pictures of itself and nothing else.
///
/// It is [`AddRenderObservation`](crate::AddRenderObservation) without the state, for policies that
/// only see: a [`Batch`](crate::vec_env::Batch) of many has one row of bytes for each environment.
///
/// ```
/// use fetch_env::{PixelOptions, PixelsOnly, make, vec_env::{VecConfig, VecEnv}};
///
/// let env = || PixelsOnly::new(make("FetchPickAndPlace-v4")?, PixelOptions::default());
/// if let Ok(envs) = (0..4).map(|_| env()).collect::<Result<Vec<_>, _>>() {
///     let mut envs = VecEnv::new(envs, VecConfig::default())?;
///     assert_eq!(envs.reset(Some(0))?.pixels().len(), 4 * 84 * 84 * 3);
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type PixelsOnly<E> = Wrapped<E, OnlyPixels>;

/// The wrapper of a [`PixelsOnly`] environment.
#[derive(Debug)]
pub struct OnlyPixels {
    pictures: Pictures,
    observation_space: Space,
}

impl<E: RenderEnv> PixelsOnly<E> {
    /// Replaces the observations of `env` by pictures.
    ///
    /// # Errors
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options; [`EnvError::Space`] if the
    /// pictures have more than 2^28 bytes.
    pub fn new(env: E, options: PixelOptions) -> Result<Self, EnvError> {
        let pictures = Pictures::new(&env, options)?;
        let observation_space = pictures.image_space().into();
        Ok(Self::from_parts(env, OnlyPixels { pictures, observation_space }))
    }

    /// The space of the pictures.
    #[must_use]
    pub const fn image_space(&self) -> ImageSpace {
        self.wrapper().pictures.image_space()
    }
}

impl<E: RenderEnv> Wrapper<E> for OnlyPixels {
    type Observation = Pixels;
    keep!(Info, ActionSpace);

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Pixels, E::Info>, EnvError> {
        env.reset_with(seed, options)?.try_map_observation(|_| self.pictures.first(&**env))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<Pixels, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|_| self.pictures.next(env))
    }

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

snapshot_pictures!(OnlyPixels);
