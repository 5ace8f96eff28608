//! Trained policies.

use std::path::PathBuf;

use baselines::{AnyPolicy, PolicyHeader, TrainedPolicy};
use fetch_env::{Camera, EnvId, RenderOptions};
use her_relabel::StateRows;
use numpy::{
    PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods,
};
use pyo3::{prelude::*, types::PyBytes};
use serde_json::{Value, json};

use crate::arrays::Numbers;
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;

/// The weights and the biases of a layer.
type Layer<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray1<f32>>);

/// A trained policy.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Policy(Exclusive<AnyPolicy>);

#[pymethods]
impl Policy {
    /// Reads the contents of a file.
    #[new]
    fn new(contents: &[u8]) -> Result<Self> {
        Ok(Self::from(AnyPolicy::from_bytes(contents).map_err(Error::value)?))
    }

    /// Loads a file.
    #[staticmethod]
    fn load(path: PathBuf) -> Result<Self> {
        let loaded = AnyPolicy::load(&path);
        Ok(Self::from(loaded.map_err(|error| Error::chain(error).at(&path))?))
    }

    /// The policy that comes with the package for an environment's task, or for one that varies.
    #[staticmethod]
    fn shipped(env_id: &str, robust: bool) -> Result<Self> {
        let id: EnvId = env_id.strip_prefix("fetch_env/").unwrap_or(env_id).parse()?;
        let load = if robust { TrainedPolicy::robust } else { TrainedPolicy::shipped };
        Ok(Self::from(AnyPolicy::State(load(id.task).map_err(Error::value)?)))
    }

    /// Replaces a file, whole or not at all.
    fn save(&self, py: Python<'_>, path: PathBuf) -> Result<()> {
        self.0.lock(py)?.save(&path).map_err(|error| Error::chain(error).at(&path))
    }

    /// The contents of a file with this policy.
    fn to_bytes<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.0.lock(py)?.to_bytes().map_err(Error::value)?))
    }

    /// How the policy was trained, as JSON.
    fn header(&self, py: Python<'_>) -> Result<String> {
        Ok(serde_json::to_string(self.0.lock(py)?.header())?)
    }

    /// The weights, with a row for each input, and the biases of each layer.
    fn layers<'py>(&self, py: Python<'py>) -> Result<Vec<Layer<'py>>> {
        let policy = self.state(py, "weights")?;
        let layers = policy.layers().iter().map(|layer| {
            let weights = PyArray1::from_slice(py, &layer.weights);
            let weights = weights.reshape([layer.num_inputs, layer.biases.len()])?;
            Ok((weights, PyArray1::from_slice(py, &layer.biases)))
        });
        layers.collect()
    }

    /// What the policy sees besides numbers, as JSON: the arguments of `draw`, or `null`.
    fn view(&self, py: Python<'_>) -> Result<String> {
        let view = match &*self.0.lock(py)? {
            AnyPolicy::State(_) => Value::Null,
            AnyPolicy::Pixels(policy) => {
                let view = policy.sight().pixels.views().next();
                view.map_or(Value::Null, |(_, view)| arguments_of(view))
            }
        };
        Ok(view.to_string())
    }

    /// The greedy actions for states of any batch shape, and pictures if the policy sees them: an
    /// array of that shape and the length of an action.
    fn act<'py>(
        &self,
        py: Python<'py>,
        observation: &Bound<'py, PyAny>,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
        pixels: Option<&Bound<'py, PyAny>>,
    ) -> Result<Bound<'py, PyArrayDyn<f32>>> {
        let PolicyHeader { observation_len, goal_len, action_len, .. } = *self.0.lock(py)?.header();
        let observation = Numbers::take("observation", observation)?;
        let batch = observation.shape().split_last().map_or(&[][..], |(_, batch)| batch);
        let states = StateRows {
            observation: &rows("observation", &observation, batch, observation_len)?,
            achieved_goal: &rows(
                "achieved_goal",
                &Numbers::take("achieved_goal", achieved_goal)?,
                batch,
                goal_len,
            )?,
            desired_goal: &rows(
                "desired_goal",
                &Numbers::take("desired_goal", desired_goal)?,
                batch,
                goal_len,
            )?,
        };
        let shape = [batch, &[action_len]].concat();
        let mut actions = vec![0.0; shape.iter().product()];
        match &mut *self.0.lock(py)? {
            AnyPolicy::State(policy) => policy.act_rows(&states, &mut actions),
            AnyPolicy::Pixels(policy) => {
                let [height, width] = policy.network().shape().picture_size();
                let pictures = pictures(pixels, &[batch, &[height, width, 3]].concat())?;
                policy.act_rows(&pictures, &states, &mut actions)
            }
        }
        .map_err(Error::value)?;
        Ok(PyArray1::from_vec(py, actions).reshape(shape)?)
    }
}

impl From<AnyPolicy> for Policy {
    fn from(policy: AnyPolicy) -> Self {
        Self(Exclusive::new(policy))
    }
}

impl Policy {
    /// Returns a copy for this call alone.
    pub(crate) fn copy(&self, py: Python<'_>) -> Result<AnyPolicy> {
        Ok(self.0.lock(py)?.clone())
    }

    /// Returns a copy of a policy that sees the state, for what only such a policy has or can be.
    pub(crate) fn state(&self, py: Python<'_>, what: &str) -> Result<TrainedPolicy> {
        match self.copy(py)? {
            AnyPolicy::State(policy) => Ok(policy),
            AnyPolicy::Pixels(_) => Err(Error::value(format!(
                "{what}: the policy sees pictures: pass one of the state"
            ))),
        }
    }
}

/// Returns what a view shows as the arguments of `draw` in Python.
fn arguments_of(view: &RenderOptions) -> Value {
    json!({
        "width": view.width(),
        "height": view.height(),
        "camera": match view.camera() {
            Camera::Free(camera) => json!(camera),
            Camera::Named(name) => json!(name),
            camera => json!(format!("{camera:?}")),
        },
        "marker": view.goals_shown(),
        "samples": view.samples(),
    })
}

/// Returns the pictures of an observation, which must have this shape.
fn pictures(pixels: Option<&Bound<'_, PyAny>>, shape: &[usize]) -> Result<Vec<u8>> {
    let wrong = |actual: String| {
        Error::value(format!(
            "pixels {actual}: the policy sees pictures, so pass an array of uint8 of the shape \
             {shape:?}, of draw(**policy.view)"
        ))
    };
    let pixels = pixels.ok_or_else(|| wrong("is missing".to_owned()))?;
    let Ok(array) = pixels.extract::<PyReadonlyArrayDyn<'_, u8>>() else {
        return Err(wrong("is no such array".to_owned()));
    };
    if array.shape() != shape {
        return Err(wrong(format!("has the shape {:?}", array.shape())));
    }
    Ok(array.as_array().iter().copied().collect())
}

/// Returns the numbers of a part of an observation, which must have the shape of the batch and
/// `len` numbers in each row.
fn rows(name: &str, numbers: &Numbers<'_>, batch: &[usize], len: usize) -> Result<Vec<f64>> {
    let expected = [batch, &[len]].concat();
    if numbers.shape() == expected {
        return Ok(numbers.to_double());
    }
    Err(Error::value(format!("{name} has the shape {:?}: pass {expected:?}", numbers.shape())))
}
