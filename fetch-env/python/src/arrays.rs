//! numpy arrays: actions and goals on their way in, observations on their way out.

use std::fmt::{self, Display, Formatter};

use fetch_env::{FetchObservation, GoalObservation, Info, Simulator};
use numpy::{
    PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods, dtype,
};
use pyo3::{intern, prelude::*, sync::PyOnceLock, types::PyDict};

use crate::error::{Error, Result};

/// The most dimensions that the crate numpy takes; numpy 2 itself takes 64.
const MAX_DIMENSIONS: usize = 32;

/// Numbers in the precision that they have in Python.
pub(crate) enum Numbers<'py> {
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

impl<'py> Numbers<'py> {
    /// Takes the argument of this name: an array, or anything that numpy can make into one. Like
    /// numpy's own arithmetic with numbers of single precision, it widens other types to double
    /// precision, except short ones.
    pub(crate) fn take(name: &str, numbers: &Bound<'py, PyAny>) -> Result<Self> {
        if let Some(taken) = Self::of_array(numbers) {
            return Ok(taken);
        }
        let py = numbers.py();
        let array = Self::convert(py, numbers).map_err(|error| Error::argument(name, error))?;
        Self::of_array(&array).ok_or_else(|| {
            Error::value(format!(
                "{name}: pass an array of real numbers with at most {MAX_DIMENSIONS} dimensions"
            ))
        })
    }

    /// Lets numpy make an array of single or double precision, if that is possible.
    fn convert(py: Python<'py>, numbers: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let numpy = numpy(py)?;
        let has_only_dlpack = numbers.hasattr(intern!(py, "__dlpack__"))?
            && !numbers.hasattr(intern!(py, "__array__"))?;
        let read = if has_only_dlpack { "from_dlpack" } else { "asarray" };
        let array = numpy.call_method1(read, (numbers,))?;
        let kind = numpy.call_method1(intern!(py, "result_type"), (&array, dtype::<f32>(py)))?;
        // Contiguous, aligned, and of no subclass.
        numpy.call_method1(intern!(py, "require"), (array, kind, "CAE"))
    }

    /// Takes an array of this shape, or anything that numpy can make into one.
    pub(crate) fn of_shape(
        name: &str,
        numbers: &Bound<'py, PyAny>,
        shape: &[usize],
    ) -> Result<Self> {
        let taken = Self::take(name, numbers)?;
        if taken.shape() == shape {
            return Ok(taken);
        }
        let (actual, expected) = (Shape(taken.shape()), Shape(shape));
        Err(Error::value(format!("{name} has the shape {actual}: pass {expected}")))
    }

    /// Takes a contiguous and aligned array of one of the two types.
    fn of_array(numbers: &Bound<'py, PyAny>) -> Option<Self> {
        let array = numbers.cast::<PyUntypedArray>().ok()?;
        if !array.is_c_contiguous() || !array.is_aligned() || array.ndim() > MAX_DIMENSIONS {
            return None;
        }
        if let Ok(single) = numbers.cast::<PyArrayDyn<f32>>() {
            return Some(Self::Single(single.try_readonly().ok()?));
        }
        let double = numbers.cast::<PyArrayDyn<f64>>().ok()?;
        Some(Self::Double(double.try_readonly().ok()?))
    }

    pub(crate) fn shape(&self) -> &[usize] {
        match self {
            Self::Single(array) => array.shape(),
            Self::Double(array) => array.shape(),
        }
    }

    /// Whether they have single precision.
    pub(crate) const fn are_single(&self) -> bool {
        matches!(self, Self::Single(_))
    }

    /// Returns them in single precision, row after row.
    pub(crate) fn to_single(&self) -> Vec<f32> {
        match self {
            Self::Single(array) => array.as_array().iter().copied().collect(),
            Self::Double(array) => array.as_array().iter().map(|number| *number as f32).collect(),
        }
    }

    /// Returns them in double precision, row after row.
    pub(crate) fn to_double(&self) -> Vec<f64> {
        match self {
            Self::Single(array) => array.as_array().iter().map(|&number| number.into()).collect(),
            Self::Double(array) => array.as_array().iter().copied().collect(),
        }
    }
}

/// Numbers of an option, for all environments or for each.
pub(crate) struct PerEnv {
    numbers: Vec<f64>,
    /// The number of elements that each environment has.
    len: usize,
}

impl PerEnv {
    /// Reads numbers of the shape `of_one`, or, for several environments, with a row for each.
    pub(crate) fn read(
        name: &str,
        numbers: &Bound<'_, PyAny>,
        of_one: &[usize],
        num_envs: Option<usize>,
    ) -> Result<Self> {
        let taken = Numbers::take(name, numbers)?;
        let of_each = num_envs.map(|num_envs| [&[num_envs], of_one].concat());
        if taken.shape() != of_one && of_each.as_deref() != Some(taken.shape()) {
            let actual = Shape(taken.shape());
            let one = if of_one.is_empty() { "a number".into() } else { Shape(of_one).to_string() };
            let each = of_each.map(|shape| format!(", or {}", Shape(&shape))).unwrap_or_default();
            return Err(Error::value(format!("{name} has the shape {actual}: pass {one}{each}")));
        }
        Ok(Self { numbers: taken.to_double(), len: of_one.iter().product() })
    }

    /// Returns the numbers of an environment.
    pub(crate) fn of(&self, env_index: usize) -> &[f64] {
        &self.numbers[env_index * self.len % self.numbers.len()..][..self.len]
    }
}

/// A shape as Python writes it.
pub(crate) struct Shape<'a>(pub(crate) &'a [usize]);

impl Display for Shape<'_> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self.0 {
            [len] => write!(f, "({len},)"),
            lens => {
                let lens: Vec<_> = lens.iter().map(ToString::to_string).collect();
                write!(f, "({})", lens.join(", "))
            }
        }
    }
}

pub(crate) fn numpy(py: Python<'_>) -> PyResult<&Bound<'_, PyModule>> {
    static NUMPY: PyOnceLock<Py<PyModule>> = PyOnceLock::new();
    Ok(NUMPY.get_or_try_init(py, || py.import("numpy").map(Bound::unbind))?.bind(py))
}

/// Returns an info with the type of number that the reference has.
pub(crate) fn info<'py>(py: Python<'py>, info: &Info) -> PyResult<Bound<'py, PyDict>> {
    static SUCCESS: PyOnceLock<[Py<PyAny>; 2]> = PyOnceLock::new();
    let [failure, success] = SUCCESS.get_or_try_init(py, || {
        let single = numpy(py)?.getattr("float32")?;
        Ok::<_, PyErr>([single.call1((0.0,))?.unbind(), single.call1((1.0,))?.unbind()])
    })?;
    let dict = PyDict::new(py);
    dict.set_item(intern!(py, "is_success"), if info.is_success { success } else { failure })?;
    Ok(dict)
}

/// Where the gripper starts, and the height of the object, if there is one.
pub(crate) type Settled<'py> = (Bound<'py, PyArray1<f64>>, Option<f64>);

/// Returns what a settled scene shows.
pub(crate) fn settled<'py>(py: Python<'py>, simulator: &impl Simulator) -> Settled<'py> {
    let settled = simulator.settled();
    (PyArray1::from_slice(py, settled.gripper_position.as_slice()), settled.object_height)
}

/// Returns an observation as a dictionary of new arrays.
pub(crate) fn observation<'py>(
    py: Python<'py>,
    observation: &FetchObservation,
) -> PyResult<Bound<'py, PyDict>> {
    let goals = [observation.achieved_goal(), observation.desired_goal()];
    observation_of(py, observation.observation(), goals)
}

/// Returns an observation with its achieved and its desired goal as a dictionary of new arrays.
pub(crate) fn observation_of<'py>(
    py: Python<'py>,
    observation: &[f64],
    [achieved_goal, desired_goal]: [&[f64]; 2],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, numbers) in [
        (intern!(py, "observation"), observation),
        (intern!(py, "achieved_goal"), achieved_goal),
        (intern!(py, "desired_goal"), desired_goal),
    ] {
        dict.set_item(key, PyArray1::from_slice(py, numbers))?;
    }
    Ok(dict)
}
