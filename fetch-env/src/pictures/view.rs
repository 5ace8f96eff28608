//! What one camera sees of environments.

use std::sync::Arc;

use fetch_sim::{Camera, RenderOptions, Renderer};

use super::{pool::RendererPool, render::RenderEnv};
use crate::gym::error::EnvError;

/// Draws the environments of one model as [`RenderOptions`] say.
///
/// All views of a process with the same model, size and samples share their renderers, one for each
/// thread that draws at the same time. Which of them draws a picture changes no byte of it. A single
/// thread draws fastest, because the renderers of a process take turns.
///
/// ```
/// use fetch_env::{Camera, Env, RenderEnv, RenderOptions, View, make};
///
/// let mut envs = [make("FetchPush-v4")?, make("FetchPush-v4")?];
/// let options = RenderOptions::default()
///     .with_width(84)
///     .with_height(84)
///     .with_camera(Camera::Named("external_camera_0".into()))
///     .with_goals_shown(false);
/// if let Ok(view) = View::new(&envs[0], options) {
///     let mut pictures = vec![0; 2 * 84 * 84 * 3];
///     for (env, picture) in envs.iter_mut().zip(pictures.chunks_exact_mut(84 * 84 * 3)) {
///         env.reset(None)?;
///         view.draw(env, |renderer| {
///             picture.copy_from_slice(env.render(renderer)?);
///             Ok(())
///         })?;
///     }
/// }
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug)]
pub struct View {
    options: RenderOptions,
    /// By index, if the model has it, so that no picture looks up a name.
    camera: Camera,
    renderers: Arc<RendererPool>,
}

impl View {
    /// Prepares pictures of environments with the model of `env`.
    ///
    /// # Errors
    /// [`RenderError`](fetch_sim::RenderError) without OpenGL and for invalid options.
    pub fn new<E: RenderEnv>(env: &E, options: RenderOptions) -> Result<Self, EnvError> {
        let renderers = RendererPool::shared(env, &options)?;
        let camera = renderers.lend(env, |renderer| {
            renderer.set_camera(options.camera().clone())?;
            let index = match options.camera() {
                Camera::Named(name) => {
                    renderer.camera_names().into_iter().position(|known| known == name)
                }
                _ => None,
            };
            Ok(index.map_or_else(|| options.camera().clone(), Camera::Index))
        })?;
        Ok(Self { options, camera, renderers })
    }

    /// Returns what the pictures show, and their size.
    pub const fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Calls `draw` with a renderer of these options, for [`RenderEnv::render`] or another of its
    /// methods.
    ///
    /// # Errors
    /// Those of `draw`, and as [`RenderEnv::renderer`].
    pub fn draw<E: RenderEnv, T>(
        &self,
        env: &E,
        draw: impl FnOnce(&mut Renderer) -> Result<T, EnvError>,
    ) -> Result<T, EnvError> {
        self.renderers.lend(env, |renderer| {
            if *renderer.options().camera() != self.camera {
                renderer.set_camera(self.camera.clone())?;
            }
            renderer.set_goals_shown(self.options.goals_shown());
            draw(renderer)
        })
    }
}
