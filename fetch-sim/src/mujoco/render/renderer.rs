//! The renderer: making one, its cameras, and the scene that it draws.

use std::{fmt, mem, sync::Arc};

use nalgebra::Vector3;

use super::{
    super::{ids::SiteId, model::Model, scene, simulator::MujocoSimulator},
    canvas::{Canvas, Segment},
    error::RenderError,
    options::{Camera, RenderOptions},
};
use crate::config::SimConfig;

/// Draws simulations of one model, off screen.
///
/// A renderer has a model and a state of its own, into which [`update_scene`](Self::update_scene)
/// copies what is visible, so that drawing never changes the simulation. Pictures are row-major with
/// the top row first, and borrowed from the renderer until the next one, without an allocation.
///
/// A renderer stays on the thread that made it, as its OpenGL context does:
/// ```compile_fail
/// fn is_send<T: Send>() {}
/// is_send::<fetch_sim::Renderer>();
/// ```
///
/// ```
/// use fetch_sim::{MujocoSimulator, RenderOptions, Renderer, SimConfig, Task};
/// use nalgebra::Vector3;
///
/// let config = SimConfig::new(Task::Reach);
/// let simulator = MujocoSimulator::new(&config)?;
/// // An error if there is no OpenGL.
/// if let Ok(mut renderer) = Renderer::new(&config, RenderOptions::default()) {
///     renderer.update_scene(&simulator, Some(Vector3::new(1.4, 0.8, 0.6)))?;
///     assert_eq!(renderer.rgb()?.len(), 480 * 480 * 3);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Renderer {
    canvas: Canvas,
    config: SimConfig,
    options: RenderOptions,
    target: Option<SiteId>,
}

impl Renderer {
    /// Creates a renderer for the simulations of `config`'s task and model.
    ///
    /// # Errors
    /// [`RenderError::NoOpenGl`] if there is none, [`RenderError::Size`],
    /// [`RenderError::UnknownCamera`], [`RenderError::FreeCamera`], or as
    /// [`FetchModel::load`](super::super::FetchModel::load).
    pub fn new(config: &SimConfig, options: RenderOptions) -> Result<Self, RenderError> {
        options.check()?;
        let model = scene::load_for_pictures(config, options.width().max(options.height()))?;
        let canvas = Canvas::new(model, &options)?;
        let target = canvas.data.model().site("target0").ok();
        let camera = options.camera().clone();
        let mut renderer = Self { canvas, config: config.clone(), options, target };
        renderer.set_camera(camera)?;
        renderer.canvas.place()?;
        Ok(renderer)
    }

    /// Returns the library that provides OpenGL in this process: `EGL` or `OSMesa`; `None` before the
    /// first renderer, or if there is no OpenGL.
    #[must_use]
    pub fn backend() -> Option<&'static str> {
        Canvas::backend()
    }

    /// Returns the renderer's settings, with its current camera.
    #[must_use]
    pub const fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Returns the model that is drawn.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        self.canvas.data.model()
    }

    /// Returns the names of the model's cameras in the model's order; empty for one without a name.
    #[must_use]
    pub fn camera_names(&self) -> Vec<&str> {
        self.model().camera_names()
    }

    /// Sets the camera of the next pictures.
    ///
    /// # Errors
    /// [`RenderError::UnknownCamera`] or [`RenderError::FreeCamera`]; the camera then stays the same.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), RenderError> {
        match &camera {
            Camera::Free(free) => {
                free.check()?;
                self.canvas.set_free_camera(free);
            }
            Camera::Named(name) => self.set_fixed_camera(self.model().camera(name), name)?,
            Camera::Index(id) => self.set_fixed_camera(Some(*id), &id.to_string())?,
        }
        self.options = mem::take(&mut self.options).with_camera(camera);
        Ok(())
    }

    fn set_fixed_camera(&mut self, id: Option<usize>, name: &str) -> Result<(), RenderError> {
        let known = self.camera_names();
        let Some(id) = id.filter(|&id| id < known.len()) else {
            let known = known.iter().map(|&name| name.to_owned()).collect();
            return Err(RenderError::UnknownCamera { camera: name.to_owned(), known });
        };
        self.canvas.set_fixed_camera(id);
        Ok(())
    }

    /// Copies the poses of a simulation, and the position of its goal (meters), for the next
    /// pictures. Without a goal the red sphere stays where the model has it.
    ///
    /// # Errors
    /// [`RenderError::OtherModel`] if the simulation is of another task or model.
    pub fn update_scene(
        &mut self,
        simulator: &MujocoSimulator,
        desired_goal: Option<Vector3<f64>>,
    ) -> Result<(), RenderError> {
        let theirs = simulator.fetch_model().config();
        let differs = theirs.task() != self.config.task() || theirs.model() != self.config.model();
        let (from, to) = (simulator.data(), &mut self.canvas.data);
        if differs || from.qpos().len() != to.qpos().len() {
            let tell = |config: &SimConfig| format!("{}, {:?}", config.task(), config.model());
            let (simulation, renderer) = (tell(theirs), tell(&self.config));
            return Err(RenderError::OtherModel { simulation, renderer });
        }
        to.qpos_mut().copy_from_slice(from.qpos());
        for mocap in 0..from.model().nmocap().min(to.model().nmocap()) {
            let (position, orientation) = from.mocap_pose(mocap);
            to.set_mocap_pose(mocap, position, orientation);
        }
        self.canvas.place()?;
        if let (Some(site), Some(position)) = (self.target, desired_goal) {
            self.canvas.data.set_site_position(site, position);
        }
        Ok(())
    }

    /// Draws and returns the colors: height x width x 3 (red, green, blue).
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn rgb(&mut self) -> Result<&[u8], RenderError> {
        self.canvas.rgb()
    }

    /// Draws and returns the distance of each pixel, height x width: meters along the direction in
    /// which the camera looks. The sky is at the farthest distance that the camera sees.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn depth(&mut self) -> Result<&[f32], RenderError> {
        self.canvas.depth()
    }

    /// Draws and returns what each pixel shows, height x width. Edges are hard, whatever the number of
    /// samples.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn segmentation(&mut self) -> Result<&[Segment], RenderError> {
        self.canvas.segmentation()
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Renderer").field("options", &self.options).finish_non_exhaustive()
    }
}
