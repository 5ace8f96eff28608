use std::{
    ffi::{CStr, CString, c_int},
    fmt,
    ptr::{self, NonNull},
    sync::{Arc, Mutex, PoisonError},
};

use nalgebra::Vector3;

use super::{
    super::{builtin, data::Data, ids::SiteId, library, model::Model, simulator::MujocoSimulator},
    Camera, FreeCamera, RenderError, RenderOptions, Segment,
    ffi::{self, RawRenderer},
    segment::RawSegment,
};
use crate::{SimConfig, SimError};

/// Draws simulations of one model, off screen.
///
/// It has a model and a state of its own, into which [`update_scene`](Self::update_scene) copies what is to be
/// seen: drawing changes nothing of the simulation. Pictures are row-major with the top row first,
/// and borrowed from the renderer until the next one: none is allocated.
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
/// // An error where there is no OpenGL.
/// if let Ok(mut renderer) = Renderer::new(&config, RenderOptions::default()) {
///     renderer.update_scene(&simulator, Some(Vector3::new(1.4, 0.8, 0.6)))?;
///     assert_eq!(renderer.rgb()?.len(), 480 * 480 * 3);
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Renderer {
    raw: NonNull<RawRenderer>,
    data: Data,
    config: SimConfig,
    options: RenderOptions,
    target: Option<SiteId>,
    rgb: Vec<u8>,
    depth: Vec<f32>,
    segments: Vec<Segment>,
    /// The shim's answer to what the numbers in a segmented picture stand for.
    objects: Vec<RawSegment>,
}

/// MuJoCo looks OpenGL's functions up when the first renderer is made.
static MAKING: Mutex<()> = Mutex::new(());

impl Renderer {
    /// A renderer of the simulations of `config`'s task and model.
    ///
    /// # Errors
    /// [`RenderError::NoOpenGl`] where there is none, [`RenderError::Size`],
    /// [`RenderError::UnknownCamera`], [`RenderError::FreeCamera`], or as
    /// [`FetchModel::load`](crate::FetchModel::load).
    pub fn new(config: &SimConfig, options: RenderOptions) -> Result<Self, RenderError> {
        options.check_size()?;
        let mut model = match config.model.scene_path(config.task)? {
            None => builtin::load_for_pictures(config.task, options.width.max(options.height))?,
            Some(path) => Model::from_path(&path)?,
        };
        let (width, height) = (options.width as c_int, options.height as c_int);
        // SAFETY: the model is alive and borrowed alone.
        unsafe {
            ffi::fs_prepare_model(model.as_mut_ptr(), width, height, options.samples.into());
        }
        let data = Data::new(Arc::new(model))?;
        let pixels = options.width as usize * options.height as usize;
        let camera = options.camera.clone();
        let mut renderer = Self {
            raw: make(data.model())?,
            target: data.model().site("target0").ok(),
            data,
            config: config.clone(),
            options,
            rgb: vec![0; 3 * pixels],
            depth: Vec::new(),
            segments: Vec::new(),
            objects: Vec::new(),
        };
        renderer.set_camera(camera)?;
        renderer.place()?;
        Ok(renderer)
    }

    /// The library that OpenGL comes from in this process: `EGL` or `OSMesa`; `None` before the
    /// first renderer, and where there is none.
    #[must_use]
    pub fn backend() -> Option<&'static str> {
        let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
        let name = ffi::fs_gl_backend();
        // SAFETY: null, or a C string that lives as long as the program.
        (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_str().ok())?
    }

    /// What pictures are like.
    #[must_use]
    pub const fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// The model that is drawn.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        self.data.model()
    }

    /// The names of the model's cameras, in the model's order; empty for one without a name.
    #[must_use]
    pub fn camera_names(&self) -> Vec<&str> {
        let model = self.model().as_ptr();
        // SAFETY: the model is alive.
        let count = unsafe { ffi::fs_camera_count(model) };
        let name = |id| {
            // SAFETY: the model is alive and has a camera of this id.
            let name = unsafe { ffi::fs_camera_name(model, id) };
            // SAFETY: null, or a C string that lives and stays as long as the model.
            (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_str().ok())?
        };
        (0..count).map(|id| name(id).unwrap_or_default()).collect()
    }

    /// Takes the next pictures from elsewhere.
    ///
    /// # Errors
    /// [`RenderError::UnknownCamera`] or [`RenderError::FreeCamera`]; the camera is then the old one.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), RenderError> {
        match &camera {
            Camera::Free(free) => self.set_free_camera(free)?,
            Camera::Named(name) => {
                let id = CString::new(name.as_str()).map_or(-1, |name| {
                    // SAFETY: the model is alive and `name` is a C string.
                    unsafe { ffi::fs_camera_id(self.model().as_ptr(), name.as_ptr()) }
                });
                self.set_fixed_camera(usize::try_from(id).ok(), name)?;
            }
            Camera::Index(id) => self.set_fixed_camera(Some(*id), &id.to_string())?,
        }
        self.options.camera = camera;
        Ok(())
    }

    fn set_free_camera(&mut self, camera: &FreeCamera) -> Result<(), RenderError> {
        camera.check()?;
        let FreeCamera { lookat, distance, azimuth, elevation } = *camera;
        let lookat = lookat.as_ptr();
        // SAFETY: the renderer is alive and `lookat` has three numbers.
        unsafe {
            ffi::fs_set_free_camera(self.raw.as_ptr(), lookat, distance, azimuth, elevation);
        }
        Ok(())
    }

    fn set_fixed_camera(&mut self, id: Option<usize>, name: &str) -> Result<(), RenderError> {
        let known = self.camera_names();
        let Some(id) = id.filter(|&id| id < known.len()) else {
            let known = known.iter().map(|&name| name.to_owned()).collect();
            return Err(RenderError::UnknownCamera { camera: name.to_owned(), known });
        };
        // SAFETY: the renderer is alive and the model has a camera of this id.
        unsafe { ffi::fs_set_fixed_camera(self.raw.as_ptr(), id as c_int) };
        Ok(())
    }

    /// Takes over where everything is in a simulation, and where its goal is (meters): the next
    /// pictures show that. Without a goal the red sphere is where the model has it.
    ///
    /// # Errors
    /// [`RenderError::OtherModel`] if the simulation is of another task or model.
    pub fn update_scene(
        &mut self,
        simulator: &MujocoSimulator,
        desired_goal: Option<Vector3<f64>>,
    ) -> Result<(), RenderError> {
        let theirs = simulator.fetch_model().config();
        let differs = theirs.task != self.config.task || theirs.model != self.config.model;
        let (from, to) = (simulator.data(), &mut self.data);
        if differs || from.qpos().len() != to.qpos().len() {
            let tell = |config: &SimConfig| format!("{}, {:?}", config.task, config.model);
            let (simulation, renderer) = (tell(theirs), tell(&self.config));
            return Err(RenderError::OtherModel { simulation, renderer });
        }
        to.qpos_mut().copy_from_slice(from.qpos());
        for mocap in 0..from.model().nmocap().min(to.model().nmocap()) {
            let (position, orientation) = from.mocap_pose(mocap);
            to.set_mocap_pose(mocap, position, orientation);
        }
        self.place()?;
        if let (Some(site), Some(position)) = (self.target, desired_goal) {
            self.data.set_site_position(site, position);
        }
        Ok(())
    }

    /// The colors: height x width x 3 (red, green, blue).
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn rgb(&mut self) -> Result<&[u8], RenderError> {
        self.draw(Picture::Rgb)?;
        flip(&mut self.rgb, self.options.height as usize);
        Ok(&self.rgb)
    }

    /// The distance of what each pixel shows, height x width: meters along the direction in which
    /// the camera looks. The sky is as far as the camera sees.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn depth(&mut self) -> Result<&[f32], RenderError> {
        self.depth.resize(self.rgb.len() / 3, 0.0);
        self.draw(Picture::Depth)?;
        let (mut near, mut far, mut parallel) = (0.0, 0.0, 0);
        // SAFETY: the renderer is alive and all three are valid for writes.
        unsafe {
            ffi::fs_planes(self.raw.as_ptr(), &raw mut near, &raw mut far, &raw mut parallel);
        }
        for depth in &mut self.depth {
            *depth = if parallel != 0 {
                near + *depth * (far - near)
            } else {
                near / (1.0 - *depth * (1.0 - near / far))
            };
        }
        flip(&mut self.depth, self.options.height as usize);
        Ok(&self.depth)
    }

    /// What each pixel shows, height x width. It has hard edges, whatever the number of samples.
    ///
    /// # Errors
    /// [`RenderError::Failed`] with MuJoCo's or OpenGL's message.
    pub fn segmentation(&mut self) -> Result<&[Segment], RenderError> {
        self.draw(Picture::Segments)?;
        flip(&mut self.rgb, self.options.height as usize);
        let room = self.objects.len();
        // SAFETY: the renderer is alive and `objects` has room for as many as told.
        let count = unsafe {
            ffi::fs_segments(self.raw.as_ptr(), self.objects.as_mut_ptr(), room as c_int)
        };
        if room < count as usize {
            self.objects.resize(count as usize, [0; 2]);
            // SAFETY: as above.
            unsafe { ffi::fs_segments(self.raw.as_ptr(), self.objects.as_mut_ptr(), count) };
        }
        self.segments.clear();
        self.segments.extend(self.rgb.chunks_exact(3).map(|rgb| {
            let number =
                usize::from(rgb[0]) + 256 * usize::from(rgb[1]) + 65536 * usize::from(rgb[2]);
            let object = number.checked_sub(1).and_then(|index| self.objects.get(index));
            object.copied().map(Segment::from).unwrap_or_default()
        }));
        Ok(&self.segments)
    }

    fn place(&mut self) -> Result<(), RenderError> {
        let model = self.data.model().as_ptr();
        // SAFETY: the data is alive, borrowed alone, and was made from this model.
        check(unsafe { ffi::fs_place(model, self.data.as_ptr()) })
    }

    fn draw(&mut self, picture: Picture) -> Result<(), RenderError> {
        let (rgb, depth) = match picture {
            Picture::Rgb | Picture::Segments => (self.rgb.as_mut_ptr(), ptr::null_mut()),
            Picture::Depth => (ptr::null_mut(), self.depth.as_mut_ptr()),
        };
        let segments = c_int::from(picture == Picture::Segments);
        let (model, data) = (self.data.model().as_ptr(), self.data.as_ptr());
        // SAFETY: renderer, model and data are alive and belong together, on the thread that made
        // them (a renderer is not `Send`); a buffer that is not null has room for the picture.
        check(unsafe { ffi::fs_draw(self.raw.as_ptr(), model, data, segments, rgb, depth) })
    }
}

/// What is read of a picture.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Picture {
    Rgb,
    Depth,
    Segments,
}

fn make(model: &Model) -> Result<NonNull<RawRenderer>, RenderError> {
    let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
    // SAFETY: a model has been loaded, so the library has.
    check(unsafe { ffi::fs_load_renderer() })?;
    let (mut raw, mut has_gl) = (ptr::null_mut(), 0);
    // SAFETY: the functions are loaded, the model is alive and prepared, and both results are valid
    // for writes.
    let status = unsafe { ffi::fs_make_renderer(model.as_ptr(), &raw mut raw, &raw mut has_gl) };
    check(status).map_err(|error| match error {
        RenderError::Failed { message } if has_gl == 0 => RenderError::NoOpenGl { reason: message },
        error => error,
    })?;
    NonNull::new(raw).ok_or_else(|| RenderError::Failed { message: "no renderer was made".into() })
}

fn check(status: c_int) -> Result<(), RenderError> {
    library::check(status).map_err(|error| match error {
        SimError::Mujoco { message } => RenderError::Failed { message },
        error => error.into(),
    })
}

/// Reverses the order of the rows: OpenGL has the bottom one first.
fn flip<T>(pixels: &mut [T], height: usize) {
    let row = pixels.len() / height;
    let (upper, lower) = pixels.split_at_mut(height / 2 * row);
    for (top, bottom) in upper.chunks_exact_mut(row).zip(lower.rchunks_exact_mut(row)) {
        top.swap_with_slice(bottom);
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // SAFETY: `raw` is owned, and dropped on the thread that made it.
        unsafe { ffi::fs_delete_renderer(self.raw.as_ptr()) };
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Renderer").field("options", &self.options).finish_non_exhaustive()
    }
}
