//! Environments that can be looked at.

pub(crate) mod pixels;

use fetch_sim::{MujocoSimulator, RenderOptions, Renderer, Segment};
use nalgebra::Vector3;

use crate::{Env, EnvError, FetchEnv, TimeLimit};

/// An environment that can be looked at.
///
/// Looking changes nothing: steps that follow give the same results, to the last bit. Where there is
/// no OpenGL, [`renderer`](Self::renderer) is an error that says what to install.
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
    /// A renderer for environments of this one's task and model. It stays on its thread, unlike
    /// environments.
    ///
    /// # Errors
    /// [`EnvError::Render`] without OpenGL, and for options that cannot be.
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError>;

    /// Shows the present state to a renderer.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] where a reset is needed; [`EnvError::Render`] if the renderer is for
    /// another task or model.
    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError>;

    /// The present state as colors: height x width x 3 (red, green, blue), the top row first.
    ///
    /// # Errors
    /// As [`update_scene`](Self::update_scene); [`EnvError::Render`] if rendering fails.
    fn render<'a>(&self, renderer: &'a mut Renderer) -> Result<&'a [u8], EnvError> {
        self.update_scene(renderer)?;
        Ok(renderer.rgb()?)
    }

    /// How far away everything is, height x width, in meters: see [`Renderer::depth`].
    ///
    /// # Errors
    /// As [`render`](Self::render).
    fn render_depth<'a>(&self, renderer: &'a mut Renderer) -> Result<&'a [f32], EnvError> {
        self.update_scene(renderer)?;
        Ok(renderer.depth()?)
    }

    /// What each pixel shows, height x width: see [`Renderer::segmentation`].
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

impl RenderEnv for FetchEnv<MujocoSimulator> {
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError> {
        Ok(Renderer::new(self.config().sim(), options)?)
    }

    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
        let goal = self.desired_goal().ok_or(EnvError::ResetNeeded)?;
        Ok(renderer.update_scene(self.simulator(), Some(Vector3::from(goal)))?)
    }
}

impl<E: RenderEnv> RenderEnv for TimeLimit<E> {
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError> {
        self.inner().renderer(options)
    }

    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
        self.inner().update_scene(renderer)
    }
}
