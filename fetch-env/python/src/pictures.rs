//! Pictures of environments as arrays.

use std::collections::VecDeque;

use fetch_env::{
    Camera, EnvError, FreeCamera, MujocoSimulator, RenderEnv, RenderError, RenderOptions, Renderer,
    Segment, View,
};
use numpy::{Element, PyArrayDyn, PyArrayMethods, dtype};
use pyo3::{
    intern,
    prelude::*,
    types::{PyDict, PyMapping, PyString},
};

use crate::arrays::{Numbers, numpy};
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::task::Simulated;

/// The name of the camera that is not part of the model.
pub(crate) const FREE: &str = "free";

/// The number of sizes for which renderers are kept.
const KEPT: usize = 8;

/// Objects in a segmented picture have the numbers of MuJoCo's `mjtObj`, as in `mujoco.Renderer`.
const BACKGROUND: i32 = -1;
const OTHER: i32 = 0;
const GEOM: i32 = 5;
const SITE: i32 = 6;

/// What pictures show unless a call says otherwise, and the views of the last ones.
pub(crate) struct Pictures {
    options: RenderOptions,
    free: Camera,
    /// With different sizes or samples; the last one was used last.
    views: VecDeque<View>,
}

/// What a call asks for; see `draw` in Python.
struct Asked<'py> {
    width: Option<Integer<u32>>,
    height: Option<Integer<u32>>,
    camera: Option<Bound<'py, PyAny>>,
    kind: String,
    marker: bool,
    samples: Integer<u8>,
}

impl<'py> Asked<'py> {
    fn of(arguments: &Bound<'py, PyDict>) -> Result<Self> {
        Ok(Self {
            width: argument(arguments, "width")?,
            height: argument(arguments, "height")?,
            camera: argument(arguments, "camera")?,
            kind: argument(arguments, "kind")?,
            marker: argument(arguments, "marker")?,
            samples: argument(arguments, "samples")?,
        })
    }
}

/// Returns an argument of this name.
fn argument<'py, T>(arguments: &Bound<'py, PyDict>, name: &str) -> Result<T>
where
    T: for<'a> FromPyObject<'a, 'py, Error: Into<PyErr>>,
{
    let value = arguments.as_any().get_item(name)?;
    value.extract().map_err(Into::<PyErr>::into).map_err(|error| Error::argument(name, error))
}

impl Pictures {
    /// Prepares to draw pictures of this size, through this camera, of environments with the
    /// simulator's model.
    pub(crate) fn new(
        simulator: &MujocoSimulator,
        [width, height]: [Integer<u32>; 2],
        camera_name: Option<String>,
        default_camera: Option<&Bound<'_, PyMapping>>,
    ) -> Result<Self> {
        let free = default_camera.map(free_camera).transpose()?.unwrap_or(FreeCamera::REFERENCE);
        let free = Camera::Free(free);
        let camera = match camera_name {
            Some(camera) if camera != FREE => {
                let known = camera_names(simulator);
                if !known.contains(&camera) {
                    return Err(RenderError::UnknownCamera { camera, known }.into());
                }
                Camera::Named(camera)
            }
            _ => free.clone(),
        };
        let options = RenderOptions::default().with_width(width.0).with_height(height.0);
        let options = options.with_camera(camera);
        options.check()?;
        Ok(Self { options, free, views: VecDeque::new() })
    }

    /// Frees the renderers.
    pub(crate) fn close(&mut self) {
        self.views.clear();
    }

    /// Draws environments: an array of `shape`, followed by height, width and the elements of a
    /// pixel.
    pub(crate) fn draw<'py>(
        &mut self,
        py: Python<'py>,
        envs: &[&Simulated],
        shape: &[usize],
        asked: &Bound<'py, PyDict>,
    ) -> Result<Bound<'py, PyAny>> {
        let asked = Asked::of(asked)?;
        let options = self.options(&asked)?;
        let canvas = Canvas { envs, shape, view: self.view(py, envs[0], options)? };
        match asked.kind.as_str() {
            "rgb" => canvas.fill(py, &[3], |env, renderer, row: &mut [u8]| {
                row.copy_from_slice(env.render(renderer)?);
                Ok(())
            }),
            "depth" => canvas.fill(py, &[], |env, renderer, row: &mut [f32]| {
                row.copy_from_slice(env.render_depth(renderer)?);
                Ok(())
            }),
            "segmentation" => canvas.fill(py, &[2], |env, renderer, row: &mut [i32]| {
                let segments = env.render_segmentation(renderer)?;
                for (pixel, segment) in row.chunks_exact_mut(2).zip(segments) {
                    pixel.copy_from_slice(&numbers(*segment));
                }
                Ok(())
            }),
            other => Err(Error::value(format!(
                "there is no kind {other:?}: pass \"rgb\", \"depth\" or \"segmentation\""
            ))),
        }
    }

    fn options(&self, asked: &Asked<'_>) -> Result<RenderOptions> {
        let or =
            |side: &Option<Integer<u32>>, default| side.as_ref().map_or(default, |side| side.0);
        let camera = match &asked.camera {
            None => self.options.camera().clone(),
            Some(camera) => self.camera(camera)?,
        };
        let options = RenderOptions::default()
            .with_width(or(&asked.width, self.options.width()))
            .with_height(or(&asked.height, self.options.height()))
            .with_samples(asked.samples.0)
            .with_goals_shown(asked.marker)
            .with_camera(camera);
        options.check()?;
        Ok(options)
    }

    fn camera(&self, camera: &Bound<'_, PyAny>) -> Result<Camera> {
        if let Ok(name) = camera.cast::<PyString>() {
            let name = name.to_cow()?.into_owned();
            return Ok(if name == FREE { self.free.clone() } else { Camera::Named(name) });
        }
        let Ok(numbers) = camera.cast::<PyMapping>() else {
            let shown = Error::shown(camera);
            return Err(Error::value(format!(
                "camera is {shown}: pass a name of camera_names, or a dictionary with distance, \
                 azimuth, elevation and lookat"
            )));
        };
        Ok(Camera::Free(free_camera(numbers)?))
    }

    /// Returns a view of these options, and keeps its renderers for the next pictures.
    fn view(&mut self, py: Python<'_>, env: &Simulated, options: RenderOptions) -> Result<View> {
        let format =
            |options: &RenderOptions| (options.width(), options.height(), options.samples());
        let view = py.detach(|| View::new(env, options))?;
        self.views.retain(|kept| format(kept.options()) != format(view.options()));
        if self.views.len() == KEPT {
            self.views.pop_front();
        }
        self.views.push_back(view.clone());
        Ok(view)
    }
}

/// The environments of an array of pictures, and what is seen of them.
struct Canvas<'a> {
    envs: &'a [&'a Simulated],
    shape: &'a [usize],
    view: View,
}

impl Canvas<'_> {
    /// Draws a row of elements for each environment, `of_pixel` for each pixel.
    fn fill<'py, T: Element>(
        &self,
        py: Python<'py>,
        of_pixel: &[usize],
        draw: impl Fn(&Simulated, &mut Renderer, &mut [T]) -> std::result::Result<(), EnvError>
        + Send
        + Sync,
    ) -> Result<Bound<'py, PyAny>> {
        let Self { envs, shape, view } = self;
        let [height, width] = [view.options().height(), view.options().width()];
        let shape = [*shape, &[height as usize, width as usize][..], of_pixel].concat();
        // Called from Python, numpy raises a MemoryError.
        let array = numpy(py)?.call_method1(intern!(py, "zeros"), (shape, dtype::<T>(py)))?;
        {
            let mut array = array.cast::<PyArrayDyn<T>>().map_err(PyErr::from)?.readwrite();
            let rows = array.as_slice_mut().map_err(Error::value)?;
            let len = rows.len() / envs.len();
            py.detach(|| {
                let mut rows = envs.iter().zip(rows.chunks_exact_mut(len));
                rows.try_for_each(|(&env, row)| view.draw(env, |renderer| draw(env, renderer, row)))
            })?;
        }
        Ok(array)
    }
}

/// Returns the names of the model's cameras.
pub(crate) fn camera_names(simulator: &MujocoSimulator) -> Vec<String> {
    simulator.data().model().camera_names().into_iter().map(str::to_owned).collect()
}

/// Reads a camera as Gymnasium describes it. What is left out is the reference's.
pub(crate) fn free_camera(numbers: &Bound<'_, PyMapping>) -> Result<FreeCamera> {
    let mut camera = FreeCamera::REFERENCE;
    for item in numbers.items()? {
        let (key, value): (String, Bound<'_, PyAny>) = item.extract()?;
        let number = match key.as_str() {
            "distance" => &mut camera.distance,
            "azimuth" => &mut camera.azimuth,
            "elevation" => &mut camera.elevation,
            "lookat" => {
                let lookat = Numbers::of_shape("lookat", &value, &[3])?.to_double();
                camera.lookat.copy_from_slice(&lookat);
                continue;
            }
            other => {
                return Err(Error::value(format!(
                    "a camera has no {other:?}: pass distance, azimuth, elevation and lookat, or \
                     name a camera of the model"
                )));
            }
        };
        *number = value.extract()?;
    }
    Ok(camera)
}

/// Returns id and kind of the object that a pixel shows.
fn numbers(segment: Segment) -> [i32; 2] {
    match segment {
        Segment::Geom(geom) => [geom.index() as i32, GEOM],
        Segment::Site(site) => [site.index() as i32, SITE],
        Segment::Background => [BACKGROUND; 2],
        _ => [BACKGROUND, OTHER],
    }
}
