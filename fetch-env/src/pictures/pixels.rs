//! Observations with pictures.

use super::frames::{Pictures, PixelOptions, snapshot_pictures};
use super::render::RenderEnv;
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::spaces::{DictSpace, ImageSpace, Space};
use crate::gym::wrappers::{
    array::SharedArray,
    macros::keep,
    wrapper::{KeepsGoals, Resetting, Wrapper},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Adds pictures of the environment to its observations.
///
/// It is Gymnasium's wrapper of this name, with stacked frames; [`PixelsOnly`](crate::PixelsOnly)
/// leaves the state out. Each observation owns its pictures, and reuses the memory of dropped
/// observations.
///
/// All environments with the same model and options share their renderers, one for each thread that
/// draws at the same time, so that many can be stepped in a [`VecEnv`](crate::VecEnv). The pictures
/// are the same on any number of threads, to the last byte.
///
/// ```
/// use fetch_env::{AddRenderObservation, Env, EnvExt, PixelOptions, make};
///
/// let options = PixelOptions::default();
/// assert_eq!(options.image_space()?.shape(), [84, 84, 3]);
/// let pixels = AddRenderObservation::new(options);
/// if let Ok(mut env) = make("FetchPush-v4")?.wrap(pixels) {
///     let first = env.reset(Some(0))?.observation;
///     assert_eq!(first.pixels.len(), 84 * 84 * 3);
///     assert!(first.state.object_position().is_some());
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Debug)]
pub struct AddRenderObservation {
    pictures: Pictures,
    /// `None` without an environment.
    observation_space: Option<Space>,
}

/// Key of the pictures in the space.
pub(super) const PIXELS: &str = "pixels";
/// Key of the state in the space, if the state is not a dictionary itself.
pub(super) const STATE: &str = "state";

/// Observation of an [`AddRenderObservation`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct PixelObservation<O> {
    /// The pictures.
    pub pixels: SharedArray<u8>,
    /// Observation of the wrapped environment.
    pub state: O,
}

impl AddRenderObservation {
    /// Adds pictures as `options` describe them.
    ///
    /// [`wrap`](crate::EnvExt::wrap) returns [`SpaceError::TooLarge`] if the observations already
    /// have the key `pixels`, or if the pictures have more than 2^28 bytes, and a
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    pub fn new(options: PixelOptions) -> Self {
        Self { pictures: Pictures::new(options), observation_space: None }
    }
}

/// Returns the space of a state with pictures: a dictionary keeps its keys, anything else becomes
/// `state`.
fn with_pixels(state: &Space, image: ImageSpace) -> Result<Space, SpaceError> {
    let mut spaces: Vec<(String, Space)> = match state {
        Space::Dict(dict) => dict.iter().map(|(key, space)| (key.into(), space.clone())).collect(),
        other => vec![(STATE.into(), other.clone())],
    };
    spaces.push((PIXELS.into(), image.into()));
    Ok(DictSpace::new(spaces)?.into())
}

impl<E: RenderEnv> Wrapper<E> for AddRenderObservation {
    type Observation = PixelObservation<E::Observation>;
    keep!(Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let image_space = self.pictures.attach(env)?;
        self.observation_space = Some(with_pixels(env.observation_space(), image_space)?);
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        let pixels = self.pictures.first(&**env)?;
        reset.try_map_observation(|state| Ok(PixelObservation { pixels, state }))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<Self::Observation, E::Info>, EnvError> {
        let step = env.step(action)?;
        let pixels = self.pictures.next(env)?;
        step.try_map_observation(|state| Ok(PixelObservation { pixels, state }))
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }
}

impl KeepsGoals for AddRenderObservation {}
snapshot_pictures!(AddRenderObservation);

/// The vectors are those of the state; the pixels are a field.
impl<O: GoalObservation> GoalObservation for PixelObservation<O> {
    type Element = O::Element;

    fn observation(&self) -> &[O::Element] {
        self.state.observation()
    }

    fn achieved_goal(&self) -> &[f64] {
        self.state.achieved_goal()
    }

    fn desired_goal(&self) -> &[f64] {
        self.state.desired_goal()
    }
}
