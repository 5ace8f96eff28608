//! Observations with pictures.

use super::frames::{Pictures, PixelOptions, Pixels, snapshot_pictures};
use super::render::RenderEnv;
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{ActionElement, Reset, Step};
use crate::gym::spaces::{DictSpace, ImageSpace, Space};
use crate::gym::wrappers::{
    macros::keep,
    wrapped::{KeepsGoals, Resetting, Wrapped, Wrapper},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// An environment that adds pictures of itself to its observations.
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
/// use fetch_env::{AddRenderObservation, Env, PixelOptions, make};
///
/// let env = make("FetchPush-v4")?;
/// if let Ok(mut env) = AddRenderObservation::new(env, PixelOptions::default()) {
///     let first = env.reset(Some(0))?.observation;
///     assert_eq!(env.image_space().shape(), [84, 84, 3]);
///     assert_eq!(first.pixels.len(), 84 * 84 * 3);
///     assert!(first.state.object_position().is_some());
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type AddRenderObservation<E> = Wrapped<E, AddRender>;

/// The wrapper of an [`AddRenderObservation`].
#[derive(Debug)]
pub struct AddRender {
    pictures: Pictures,
    observation_space: Space,
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
    pub pixels: Pixels,
    /// Observation of the wrapped environment.
    pub state: O,
}

impl<E: RenderEnv> AddRenderObservation<E> {
    /// Adds pictures to the observations of `env`.
    ///
    /// # Errors
    /// [`EnvError::Space`] if the observations of `env` already have the key `pixels`, or if the
    /// pictures have more than 2^28 bytes;
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    pub fn new(env: E, options: PixelOptions) -> Result<Self, EnvError> {
        let observation_space = with_pixels(env.observation_space(), options.image_space()?)?;
        let pictures = Pictures::new(&env, options)?;
        Ok(Self::from_parts(env, AddRender { pictures, observation_space }))
    }

    /// The space of the pictures.
    #[must_use]
    pub const fn image_space(&self) -> ImageSpace {
        self.wrapper().pictures.image_space()
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

impl<E: RenderEnv> Wrapper<E> for AddRender {
    type Observation = PixelObservation<E::Observation>;
    keep!(Info, ActionSpace);

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

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

impl KeepsGoals for AddRender {}
snapshot_pictures!(AddRender);

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
