//! Environments that can be rendered.

use fetch_sim::{MujocoSimulator, RenderError, RenderOptions, Renderer, Segment, SimConfig};
use goal_reward::GoalReward;
use nalgebra::Vector3;
use smallvec::SmallVec;

use crate::fetch::{env::FetchEnv, task::FetchTask};
use crate::gym::wrappers::{wrapped::Wrapped, wrapper::Wrapper};
use crate::gym::{env::Env, error::EnvError};

/// An environment that can be rendered.
///
/// Rendering changes nothing: later steps give the same results, to the last bit. Without OpenGL
/// [`renderer`](Self::renderer) returns an error that says what to install. All methods return a
/// [`RenderError`] as [`EnvError::Other`], where [`EnvError::downcast_ref`] finds it.
///
/// ```
/// use fetch_env::{Env, RenderEnv, RenderOptions, make};
///
/// let mut env = make("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// if let Ok(mut renderer) = env.renderer(RenderOptions::default()) {
///     let rgb = env.render(&mut renderer)?; // the top row first
///     assert_eq!(rgb.len(), 480 * 480 * 3);
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait RenderEnv: Env {
    /// Returns the task and model of the pictures. Environments with the same ones share renderers.
    fn sim_config(&self) -> &SimConfig;

    /// Creates a renderer for environments with this task and model.
    ///
    /// # Errors
    /// [`RenderError`] without OpenGL and for invalid options.
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError> {
        Ok(Renderer::new(self.sim_config(), options)?)
    }

    /// Gives a renderer the current state.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before a reset and after a failure; [`RenderError`] if the
    /// renderer is for another task or model.
    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError>;

    /// Renders the colors of the current state: height x width x 3 (red, green, blue), the top row
    /// first.
    ///
    /// # Errors
    /// As [`update_scene`](Self::update_scene); [`RenderError`] if rendering fails.
    fn render<'a>(&self, renderer: &'a mut Renderer) -> Result<&'a [u8], EnvError> {
        self.update_scene(renderer)?;
        Ok(renderer.rgb()?)
    }

    /// Renders distances from the camera, height x width, in meters: see [`Renderer::depth`].
    ///
    /// # Errors
    /// As [`render`](Self::render).
    fn render_depth<'a>(&self, renderer: &'a mut Renderer) -> Result<&'a [f32], EnvError> {
        self.update_scene(renderer)?;
        Ok(renderer.depth()?)
    }

    /// Renders what each pixel shows, height x width: see [`Renderer::segmentation`].
    ///
    /// # Errors
    /// As [`render`](Self::render).
    fn render_segmentation<'a>(
        &self,
        renderer: &'a mut Renderer,
    ) -> Result<&'a [Segment], EnvError> {
        self.update_scene(renderer)?;
        Ok(renderer.segmentation()?)
    }
}

impl<R: GoalReward, T: FetchTask<MujocoSimulator>> RenderEnv for FetchEnv<MujocoSimulator, R, T> {
    fn sim_config(&self) -> &SimConfig {
        self.config().sim()
    }

    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
        if self.desired_goal().is_none() {
            return Err(EnvError::ResetNeeded);
        }
        let positions = self.goal_positions();
        let goals: SmallVec<[_; 4]> = positions.iter().copied().map(Vector3::from).collect();
        renderer.set_looks(self.variation().looks);
        Ok(renderer.update_scene(self.simulator(), &goals)?)
    }
}

/// Implements [`RenderEnv`] for pointers to environments.
macro_rules! forward {
    ($($pointer:ty),*) => {$(
        impl<E: RenderEnv + ?Sized> RenderEnv for $pointer {
            fn sim_config(&self) -> &SimConfig {
                (**self).sim_config()
            }

            fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
                (**self).update_scene(renderer)
            }
        }
    )*};
}

forward!(Box<E>, &mut E);

impl<E: RenderEnv, W: Wrapper<E>> RenderEnv for Wrapped<E, W> {
    fn sim_config(&self) -> &SimConfig {
        self.inner().sim_config()
    }

    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
        self.inner().update_scene(renderer)
    }
}

impl From<RenderError> for EnvError {
    fn from(error: RenderError) -> Self {
        Self::other(error)
    }
}
