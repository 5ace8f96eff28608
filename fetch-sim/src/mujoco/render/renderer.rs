//! The renderer: making one, its cameras, and the scene that it draws.

use std::{
    ffi::{CStr, c_int},
    fmt,
    mem::{self, ManuallyDrop},
    process, ptr,
    sync::{
        Arc, Mutex, OnceLock, PoisonError,
        atomic::{AtomicU32, Ordering::SeqCst},
    },
};

use nalgebra::Vector3;

use super::{
    super::{
        binding::{
            data::Data,
            ffi::{self, RawRenderer, RawSegment},
            ids::SiteId,
            library::{Owned, check_as},
            model::Model,
        },
        robot::{scene, simulator::MujocoSimulator},
    },
    error::RenderError,
    looks::ShownLooks,
    options::{Camera, RenderOptions},
    segment::Segment,
};
use crate::{config::SimConfig, looks::Looks, physics::PhysicsFactor, simulator::Simulator};

/// Draws simulations of one model, off screen.
///
/// A renderer has a separate model and state, into which [`update_scene`](Self::update_scene)
/// copies what is visible, so drawing never changes the simulation. Pictures are row-major with the
/// top row first. They are borrowed from the renderer, which reuses their memory.
///
/// Any thread may use a renderer, one at a time. Its OpenGL context is current only within a call,
/// and afterwards the context that was current on the thread before, if any, is current again. The
/// renderers of a process draw one after another, because drivers crash otherwise (Mesa 22.3 does).
///
/// OpenGL does not survive a `fork`, because the child lacks the threads of its drivers. In the
/// child, every picture is [`RenderError::Forked`], and so is a new renderer, unless the parent had
/// none before. Dropping one is always safe.
///
/// ```
/// # #[cfg(not(fetch_sim_no_shim))] {
/// use fetch_sim::{MujocoSimulator, RenderOptions, Renderer, SimConfig, Task};
/// use nalgebra::Vector3;
///
/// let config = SimConfig::new(Task::Reach);
/// let simulator = MujocoSimulator::new(&config)?;
/// // An error if there is no OpenGL.
/// if let Ok(mut renderer) = Renderer::new(&config, RenderOptions::default()) {
///     renderer.update_scene(&simulator, &[Vector3::new(1.4, 0.8, 0.6)])?;
///     assert_eq!(renderer.rgb()?.len(), 480 * 480 * 3);
/// }
/// # }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Renderer {
    pub(super) raw: ManuallyDrop<Owned<RawRenderer>>,
    /// The state that is drawn.
    pub(super) data: Data,
    config: SimConfig,
    pub(super) options: RenderOptions,
    /// The site `target{i}`, if there is one, for each i.
    targets: Vec<Option<SiteId>>,
    /// The goals that have no site.
    pub(super) goals: Vec<[f64; 3]>,
    pub(super) looks: ShownLooks,
    pub(super) rgb: Vec<u8>,
    pub(super) depth: Vec<f32>,
    pub(super) segments: Vec<Segment>,
    /// The objects to which the numbers in a segmented picture refer.
    pub(super) objects: Vec<RawSegment>,
}

// SAFETY: the OpenGL context is current on a thread only within a call that borrows the renderer
// mutably or drops it, and may be made current on another thread afterwards; the scene is plain
// memory that belongs to no thread.
unsafe impl Send for Renderer {}

/// The largest side, in pixels, of a picture that needs fewer facets.
const SMALL_SIDE: u32 = 128;

/// Locked while a renderer is made, because MuJoCo looks up OpenGL's functions for the first one.
static MAKING: Mutex<()> = Mutex::new(());

/// The id of the process that uses OpenGL, or [`NONE`].
static PROCESS: AtomicU32 = AtomicU32::new(NONE);

/// The id of no process.
const NONE: u32 = 0;

/// Why this process has no OpenGL. A forked child reads it without a lock.
static ABSENT: OnceLock<String> = OnceLock::new();

impl Renderer {
    /// Checks that this process was not forked from one that had renderers. It takes no lock, which
    /// a thread of the parent could have held.
    ///
    /// # Errors
    /// [`RenderError::Forked`].
    pub fn check_process() -> Result<(), RenderError> {
        match PROCESS.load(SeqCst) {
            NONE => Ok(()),
            id if id == process::id() => Ok(()),
            _ => Err(RenderError::Forked),
        }
    }

    /// Creates a renderer for the simulations of `config`'s task and model.
    ///
    /// # Errors
    /// [`RenderError::NoOpenGl`] if there is none, [`RenderError::Size`],
    /// [`RenderError::UnknownCamera`], [`RenderError::FreeCamera`], [`RenderError::Forked`], or as
    /// [`FetchModel::load`](crate::FetchModel::load).
    pub fn new(config: &SimConfig, options: RenderOptions) -> Result<Self, RenderError> {
        options.check()?;
        if let Some(reason) = ABSENT.get() {
            return Err(RenderError::NoOpenGl { reason: reason.clone() });
        }
        Self::check_process()?;
        let (width, height) = (options.width(), options.height());
        let is_small = width.max(height) <= SMALL_SIDE;
        let settings = if is_small { scene::SMALL_PICTURE } else { scene::PICTURE };
        let mut model = scene::load(config, settings)?;
        let samples = c_int::from(options.samples());
        // SAFETY: the model is alive and borrowed mutably.
        unsafe {
            ffi::fs_prepare_model(model.as_mut_ptr(), width as c_int, height as c_int, samples);
        }
        let target = |i| model.site(&format!("target{i}")).ok();
        let targets: Vec<_> = (0..model.nsite()).map(target).collect();
        let looks = ShownLooks::new(&model, config.task(), &targets);
        let data = Data::new(Arc::new(model))?;
        let (camera, goals_shown) = (options.camera().clone(), options.goals_shown());
        let mut renderer = Self {
            raw: ManuallyDrop::new(make(data.model())?),
            data,
            config: config.clone(),
            options,
            targets,
            goals: Vec::new(),
            looks,
            rgb: vec![0; 3 * width as usize * height as usize],
            depth: Vec::new(),
            segments: Vec::new(),
            objects: Vec::new(),
        };
        renderer.set_camera(camera)?;
        renderer.set_goals_shown(goals_shown);
        renderer.place()?;
        Ok(renderer)
    }

    /// Returns the library that provides OpenGL in this process: `EGL` or `OSMesa`; `None` before
    /// the first renderer, if there is no OpenGL, or after a `fork`.
    #[must_use]
    pub fn backend() -> Option<&'static str> {
        if PROCESS.load(SeqCst) != process::id() {
            return None;
        }
        let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
        let name = ffi::fs_gl_backend();
        // SAFETY: null, or a C string that lives as long as the program.
        (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_str().ok())?
    }

    /// Returns the renderer's settings, with its current camera, and whether it shows goals.
    pub const fn options(&self) -> &RenderOptions {
        &self.options
    }

    /// Returns the model that is drawn.
    #[must_use]
    pub const fn model(&self) -> &Arc<Model> {
        self.data.model()
    }

    /// Returns the names of the model's cameras in the model's order; empty for one without a name.
    #[must_use]
    pub fn camera_names(&self) -> Vec<&str> {
        self.model().camera_names()
    }

    /// Sets the camera of the next pictures.
    ///
    /// # Errors
    /// [`RenderError::UnknownCamera`] or [`RenderError::FreeCamera`]; the camera then stays the
    /// same.
    pub fn set_camera(&mut self, camera: Camera) -> Result<(), RenderError> {
        match &camera {
            Camera::Free(free) => {
                free.check()?;
                let numbers = free.numbers().map(|(_, value)| value);
                // SAFETY: the renderer is alive and `numbers` is valid for reads.
                unsafe { ffi::fs_set_free_camera(self.raw.as_ptr(), &raw const numbers) };
            }
            Camera::Named(name) => self.set_fixed_camera(self.model().camera(name), name)?,
            Camera::Index(id) => self.set_fixed_camera(Some(*id), id)?,
        }
        self.options = mem::take(&mut self.options).with_camera(camera);
        Ok(())
    }

    fn set_fixed_camera(
        &mut self,
        id: Option<usize>,
        name: &dyn fmt::Display,
    ) -> Result<(), RenderError> {
        let Some(id) = id.filter(|&id| id < self.model().ncam()) else {
            let known = self.camera_names().into_iter().map(str::to_owned).collect();
            return Err(RenderError::UnknownCamera { camera: name.to_string(), known });
        };
        // SAFETY: the renderer is alive and the model has a camera of this id.
        unsafe { ffi::fs_set_fixed_camera(self.raw.as_ptr(), id as c_int) };
        Ok(())
    }

    /// Sets whether the next pictures show the goals.
    pub fn set_goals_shown(&mut self, goals_shown: bool) {
        self.options = mem::take(&mut self.options).with_goals_shown(goals_shown);
        self.looks.goals_shown = goals_shown;
    }

    /// Sets how the scene looks in the next pictures, where that differs from the model.
    pub const fn set_looks(&mut self, looks: Looks) {
        self.looks.looks = looks;
    }

    /// Copies the poses of a simulation, the size of its object and the positions of its goals
    /// (meters) for the next pictures. Goal `i` is shown by the site `target{i}` if the model has it,
    /// and otherwise by a sphere like that of `target0`. A site without a goal stays where the model
    /// has it.
    ///
    /// The scene has room for 1,000 spheres and sites of the model; drawing more is
    /// [`RenderError::Failed`].
    ///
    /// # Errors
    /// [`RenderError::OtherModel`] if the simulation is of another task or model.
    pub fn update_scene(
        &mut self,
        simulator: &MujocoSimulator,
        goals: &[Vector3<f64>],
    ) -> Result<(), RenderError> {
        let theirs = simulator.fetch_model().config();
        let differs = theirs.task() != self.config.task() || theirs.model() != self.config.model();
        let (from, to) = (simulator.data(), &mut self.data);
        if differs || from.qpos().len() != to.qpos().len() {
            let tell = |config: &SimConfig| format!("{}, {:?}", config.task(), config.model());
            let (simulation, renderer) = (tell(theirs), tell(&self.config));
            return Err(RenderError::OtherModel { simulation, renderer });
        }
        to.qpos_mut().copy_from_slice(from.qpos());
        for mocap in 0..from.model().nmocap().min(to.model().nmocap()) {
            let (position, orientation) = from.mocap_pose(mocap)?;
            to.set_mocap_pose(mocap, position, orientation)?;
        }
        self.place()?;
        self.looks.object_size = simulator.physics().scale(PhysicsFactor::ObjectSize);
        self.goals.clear();
        for (i, &goal) in goals.iter().enumerate() {
            match self.target(i) {
                Some(site) => self.data.set_site_position(site, goal)?,
                None => self.goals.push(goal.into()),
            }
        }
        Ok(())
    }

    /// Returns the site of a goal, if the model has one.
    pub(super) fn target(&self, goal: usize) -> Option<SiteId> {
        self.targets.get(goal).copied().flatten()
    }

    /// Computes from the positions in `data` what is drawn.
    fn place(&mut self) -> Result<(), RenderError> {
        let model = self.data.model().as_ptr();
        // SAFETY: the data is alive, borrowed mutably, and was made from this model.
        check_as(unsafe { ffi::fs_place(model, self.data.as_ptr()) }, failed)
    }
}

impl Drop for Renderer {
    fn drop(&mut self) {
        // In a forked process OpenGL would wait for the parent's threads.
        if Self::check_process().is_ok() {
            // SAFETY: nothing uses the renderer after its drop, and its model is still alive.
            unsafe { ManuallyDrop::drop(&mut self.raw) };
        }
    }
}

impl fmt::Debug for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Renderer").field("options", &self.options).finish_non_exhaustive()
    }
}

fn make(model: &Model) -> Result<Owned<RawRenderer>, RenderError> {
    // First, so that no child waits for the lock.
    PROCESS.store(process::id(), SeqCst);
    let _alone = MAKING.lock().unwrap_or_else(PoisonError::into_inner);
    let (mut raw, mut has_gl) = (ptr::null_mut(), 0);
    // SAFETY: the library is loaded because a model is; the model is alive and prepared, and both
    // results are valid for writes.
    let status = unsafe { ffi::fs_make_renderer(model.as_ptr(), &raw mut raw, &raw mut has_gl) };
    check_as(status, |message| match has_gl {
        // The search for a library is not repeated.
        0 if ffi::fs_gl_backend().is_null() => {
            RenderError::NoOpenGl { reason: ABSENT.get_or_init(|| message).clone() }
        }
        0 => RenderError::NoOpenGl { reason: message },
        _ => failed(message),
    })?;
    // SAFETY: the renderer was just made for the caller, which drops it before the model.
    Ok(unsafe { Owned::new(raw, "a renderer") }?)
}

pub(super) fn failed(message: String) -> RenderError {
    RenderError::Failed { message }
}
