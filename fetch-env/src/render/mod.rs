//! Rendering: environments that can be shown to a renderer.

pub(crate) mod pixels;

use fetch_sim::{RenderOptions, Renderer, Segment};

use crate::env::{Env, time_limit::TimeLimit};
use crate::error::EnvError;

/// An environment that can be rendered.
///
/// Rendering changes nothing: later steps give the same results, to the last bit. Without OpenGL
/// [`renderer`](Self::renderer) returns an error that says what to install.
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
    /// Creates a renderer for environments with this task and model. Unlike environments it stays
    /// on its thread.
    ///
    /// # Errors
    /// [`EnvError::Render`] without OpenGL and for invalid options.
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError>;

    /// Shows the current state to a renderer.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before a reset and after a failure; [`EnvError::Render`] if the
    /// renderer is for another task or model.
    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError>;

    /// Renders the colors of the current state: height x width x 3 (red, green, blue), the top row
    /// first.
    ///
    /// # Errors
    /// As [`update_scene`](Self::update_scene); [`EnvError::Render`] if rendering fails.
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

impl<E: RenderEnv> RenderEnv for TimeLimit<E> {
    fn renderer(&self, options: RenderOptions) -> Result<Renderer, EnvError> {
        self.inner().renderer(options)
    }

    fn update_scene(&self, renderer: &mut Renderer) -> Result<(), EnvError> {
        self.inner().update_scene(renderer)
    }
}
