//! Observations with pictures, or of pictures alone.

use super::frames::{Pictures, PixelOptions};
use super::observations::{PIXELS, PixelObservation, Pixels, STATE};
use super::render::RenderEnv;
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::spaces::{DictSpace, Space};
use crate::gym::wrappers::{
    macros::keep,
    wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Adds pictures of the environment to its observations.
///
/// It is Gymnasium's wrapper of this name, with stacked frames; [`PixelsOnly`](crate::PixelsOnly)
/// leaves the state out. Each observation owns its pictures, and reuses the memory of dropped
/// observations.
///
/// Environments share their renderers, as [`View`](crate::View)s do, so that many can be stepped in a
/// [`VecEnv`](crate::VecEnv). The pictures are the same on any number of threads, to the last byte.
///
/// The key of the pictures is `pixels`: an image, or a dictionary of the images of several views.
///
/// ```
/// use fetch_env::{AddRenderObservation, Env, EnvExt, PixelOptions, make};
///
/// let options = PixelOptions::default();
/// let pixels = AddRenderObservation::new(options);
/// if let Ok(mut env) = make("FetchPush-v4")?.wrap(pixels) {
///     let first = env.reset(Some(0))?.observation;
///     assert_eq!(first.pixels.len(), 84 * 84 * 3);
///     assert!(first.state.object_position().is_some());
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Debug)]
pub struct AddRenderObservation(Pictures);

impl AddRenderObservation {
    /// Adds pictures as `options` describe them.
    ///
    /// [`wrap`](crate::EnvExt::wrap) returns [`SpaceError::DuplicateKey`] if the observations
    /// already have the key `pixels` or two views have one key, [`SpaceError::TooLarge`] if the
    /// pictures have more than 2^28 bytes, and a [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    pub fn new(options: PixelOptions) -> Self {
        Self(Pictures::new(options))
    }
}

/// Returns the space of a state with pictures: a dictionary keeps its keys, anything else becomes
/// `state`.
fn with_pixels(state: &Space, pixels: Space) -> Result<Space, SpaceError> {
    let mut spaces: Vec<(String, Space)> = match state {
        Space::Dict(dict) => dict.iter().map(|(key, space)| (key.into(), space.clone())).collect(),
        other => vec![(STATE.into(), other.clone())],
    };
    spaces.push((PIXELS.into(), pixels));
    Ok(DictSpace::new(spaces)?.into())
}

/// Observes pictures of the environment and nothing else.
///
/// It is [`AddRenderObservation`](crate::AddRenderObservation) without the state, for policies that
/// see nothing else: a [`VecStep`](crate::vec_env::VecStep) of many has one row of bytes for each
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
pub struct PixelsOnly(Pictures);

impl PixelsOnly {
    /// Observes pictures as `options` describe them.
    ///
    /// [`wrap`](crate::EnvExt::wrap) returns a [`RenderError`](fetch_sim::RenderError) without
    /// OpenGL and for invalid options, and [`SpaceError::TooLarge`] if the pictures have more than
    /// 2^28 bytes.
    #[must_use]
    pub fn new(options: PixelOptions) -> Self {
        Self(Pictures::new(options))
    }
}

/// Implements what wrappers with pictures have in common. The last two arguments are functions: of
/// the spaces of the state and of the pictures, and of the two themselves. The state of a wrapper
/// is the frames that later observations show again. Without stacked frames there are none to keep.
macro_rules! picture_wrapper {
    ($wrapper:ty, $observation:ty, $make_space:expr, $observe:expr) => {
        impl<E: RenderEnv> Wrapper<E> for $wrapper {
            type Observation = $observation;
            keep!(Info, ActionSpace);

            fn attach(&mut self, env: &E) -> Result<(), EnvError> {
                self.0.attach(env, $make_space)
            }

            fn reset(
                &mut self,
                env: &mut Resetting<'_, E>,
                seed: Option<u64>,
                options: &E::ResetOptions,
            ) -> Result<Reset<Self::Observation, E::Info>, EnvError> {
                let reset = env.reset_with(seed, options)?;
                let pixels = self.0.first(&**env)?;
                reset.try_map_observation(|state| Ok($observe(state, pixels)))
            }

            fn step(
                &mut self,
                env: &mut E,
                action: &[ActionElement<E>],
            ) -> Result<Step<Self::Observation, E::Info>, EnvError> {
                let step = env.step(action)?;
                let pixels = self.0.next(env)?;
                step.try_map_observation(|state| Ok($observe(state, pixels)))
            }

            fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
                self.0.observation_space(env)
            }
        }

        impl SnapshotWrapper for $wrapper {
            type State = Vec<Vec<u8>>;

            fn state(&self) -> Self::State {
                self.0.later_frames()
            }

            fn check_state(&self, state: &Self::State) -> Result<(), EnvError> {
                self.0.check_later_frames(state)
            }

            fn set_state(&mut self, state: &Self::State) {
                self.0.set_later_frames(state);
            }
        }
    };
}

picture_wrapper!(
    AddRenderObservation,
    PixelObservation<E::Observation>,
    with_pixels,
    |state, pixels| PixelObservation { pixels, state }
);
picture_wrapper!(PixelsOnly, Pixels, |_, pixels| Ok(pixels), |_, pixels| pixels);

/// Of the state: pictures are as they are.
impl KeepsGoals for AddRenderObservation {
    const KEEPS_SYMMETRIES: bool = true;
}
