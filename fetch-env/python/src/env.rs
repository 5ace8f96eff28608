//! One environment.

use std::collections::BTreeMap;

use fetch_env::{Env as _, FetchObservation, Info, MovingGoal, SnapshotEnv, Step};
use fetch_sim::scene_files;
use numpy::{PyArray1, PyArray2};
use pyo3::{
    IntoPyObjectExt,
    prelude::*,
    types::{PyBytes, PyDict, PyMapping},
};

use crate::arrays::{self, Numbers, Settled};
use crate::config::{Config, GOAL_LEN};
use crate::error::{Error, Result};
use crate::exclusive::Exclusive;
use crate::integer::Integer;
use crate::pictures::{Pictures, camera_names};
use crate::reset::{reset_options, seed};
use crate::task::{self, Own, Simulated};
use crate::variation::varied;
use crate::warnings::simulate;

/// Observation, reward, whether the task has ended or was cut off, and info.
type StepTuple<'py> = (Bound<'py, PyDict>, f64, bool, bool, Bound<'py, PyDict>);

/// One environment, without a time limit. A call that simulates releases the interpreter.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Env {
    parts: Exclusive<Parts>,
    /// The task in Python, if there is one.
    own: Option<Own>,
}

/// The environment and its renderer.
struct Parts {
    /// `None` when it is closed.
    env: Option<Simulated>,
    pictures: Pictures,
}

#[pymethods]
impl Env {
    #[new]
    fn new(
        py: Python<'_>,
        config: &Config,
        width: Integer<u32>,
        height: Integer<u32>,
        camera_name: Option<String>,
        default_camera: Option<&Bound<'_, PyMapping>>,
    ) -> Result<Self> {
        let own = config.own(false);
        let env = simulate(py, || task::make(config.config.clone(), own.as_ref()))?;
        let size = [width, height];
        let pictures = Pictures::new(env.simulator(), size, camera_name, default_camera)?;
        let parts = Exclusive::new(Parts { env: Some(env), pictures });
        Ok(Self { parts, own })
    }

    /// Begins an episode, and returns its first observation.
    #[pyo3(signature = (seed = None, options = None))]
    fn reset<'py>(
        &self,
        py: Python<'py>,
        seed: Option<&Bound<'py, PyAny>>,
        options: Option<&Bound<'py, PyDict>>,
    ) -> Result<Bound<'py, PyDict>> {
        let options = reset_options(options, self.own.as_ref())?;
        let seed = self::seed(seed)?;
        let mut parts = self.parts.lock(py)?;
        let env = parts.env()?;
        let reset = simulate(py, || env.reset_with(seed, &options))?;
        self.check()?;
        Ok(arrays::observation(py, &reset.observation)?)
    }

    /// Takes an action, in the precision that it has.
    fn step<'py>(&self, py: Python<'py>, action: &Bound<'py, PyAny>) -> Result<StepTuple<'py>> {
        let action = Numbers::take("action", action)?;
        if action.shape().len() != 1 {
            let shape = action.shape();
            return Err(Error::value(format!("the action has the shape {shape:?}: pass (4,)")));
        }
        let mut parts = self.parts.lock(py)?;
        let env = parts.env()?;
        let step: Step<FetchObservation, Info> = if action.are_single() {
            let action = action.to_single();
            simulate(py, || env.step(&action))
        } else {
            let action = action.to_double();
            simulate(py, || env.step_f64(&action))
        }?;
        self.check()?;
        let Step { observation, reward, terminated, truncated, info } = step;
        let observation = arrays::observation(py, &observation)?;
        Ok((observation, reward, terminated, truncated, arrays::info(py, &info)?))
    }

    /// Replaces the settings of rewards and of what is drawn.
    fn set_config(&self, py: Python<'_>, config: &Config) -> Result<()> {
        config.check_built_in("make another environment with the settings")?;
        Ok(self.parts.lock(py)?.env()?.set_config(config.config.clone())?)
    }

    /// The numbers of the episode that differ from the model's, by name.
    fn variation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        varied(py, self.parts.lock(py)?.env()?.variation())
    }

    /// The goal of the episode; None before a reset.
    fn goal<'py>(&self, py: Python<'py>) -> Result<Option<Bound<'py, PyArray1<f64>>>> {
        let mut parts = self.parts.lock(py)?;
        Ok(parts.env()?.desired_goal().map(|goal| PyArray1::from_slice(py, goal)))
    }

    /// Replaces the goal of the episode.
    fn set_goal(&self, py: Python<'_>, goal: &Bound<'_, PyAny>) -> Result<()> {
        let goal = Numbers::take("goal", goal)?;
        if goal.shape().len() != 1 {
            let shape = goal.shape();
            let len = self.own.as_ref().map_or(GOAL_LEN, |own| own.task.goal_len);
            return Err(Error::value(format!("the goal has the shape {shape:?}: pass ({len},)")));
        }
        Ok(self.parts.lock(py)?.env()?.set_desired_goal(&goal.to_double())?)
    }

    /// Draws a goal, with which the random numbers go on.
    fn sample_goal<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyArray1<f64>>> {
        if self.own.is_some() {
            return Err(Error::value("a task of your own draws its goals in begin_episode()"));
        }
        Ok(PyArray1::from_slice(py, &self.parts.lock(py)?.env()?.sample_goal()?))
    }

    /// Where the gripper starts, and the height of the object, in meters.
    fn settled<'py>(&self, py: Python<'py>) -> Result<Settled<'py>> {
        Ok(arrays::settled(py, self.parts.lock(py)?.env()?.simulator()))
    }

    /// The current observation.
    fn observe<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        Ok(arrays::observation(py, &self.observation(py)?)?)
    }

    /// The seed of the random numbers, and how many 64-bit numbers were drawn; None before a reset.
    fn random(&self, py: Python<'_>) -> Result<Option<(u64, u64)>> {
        let mut parts = self.parts.lock(py)?;
        let random = parts.env()?.np_random();
        Ok(random.map(|random| (random.initial_seed(), random.draws())))
    }

    /// Everything that determines the future, as bytes.
    fn get_state<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyBytes>> {
        let snapshot = self.parts.lock(py)?.env()?.snapshot();
        Ok(PyBytes::new(py, &serde_json::to_vec(&snapshot)?))
    }

    /// Restores a state that `get_state` of an environment with equal settings returned.
    fn set_state(&self, py: Python<'_>, state: &[u8]) -> Result<()> {
        let state = serde_json::from_slice(state)?;
        let mut parts = self.parts.lock(py)?;
        let env = parts.env()?;
        simulate(py, || env.restore(&state))
    }

    /// The scene: the path of a file, or the name of the main file and the contents of all files.
    fn scene<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyAny>> {
        let mut parts = self.parts.lock(py)?;
        let sim = parts.env()?.config().sim();
        if let Some(path) = sim.model().scene_path(sim.task())? {
            return Ok(path.to_string_lossy().into_bound_py_any(py)?);
        }
        let files = scene_files(sim)?;
        let contents: BTreeMap<_, _> = files.iter().collect();
        let main = files.iter().next().map(|(name, _)| name);
        Ok((main, contents).into_bound_py_any(py)?)
    }

    /// The state of the simulation, and the positions and velocities of the settled scene.
    fn simulation<'py>(&self, py: Python<'py>) -> Result<Bound<'py, PyDict>> {
        let mut parts = self.parts.lock(py)?;
        let simulator = parts.env()?.simulator();
        let (data, (qpos, qvel)) = (simulator.data(), simulator.fetch_model().start());
        let dict = PyDict::new(py);
        dict.set_item("time", data.time())?;
        let (mut positions, mut orientations) = (Vec::new(), Vec::new());
        for mocap in 0..data.model().nmocap() {
            let (position, q) = data.mocap_pose(mocap)?;
            positions.push(position.as_slice().to_vec());
            orientations.push(vec![q.w, q.i, q.j, q.k]);
        }
        for (key, rows) in [("mocap_pos", positions), ("mocap_quat", orientations)] {
            dict.set_item(key, PyArray2::from_vec2(py, &rows).map_err(Error::value)?)?;
        }
        for (key, numbers) in [
            ("qpos", data.qpos()),
            ("qvel", data.qvel()),
            ("ctrl", data.ctrl()),
            ("initial_qpos", qpos),
            ("initial_qvel", qvel),
        ] {
            dict.set_item(key, PyArray1::from_slice(py, numbers))?;
        }
        Ok(dict)
    }

    /// The names of the model's cameras.
    fn camera_names(&self, py: Python<'_>) -> Result<Vec<String>> {
        Ok(camera_names(self.parts.lock(py)?.env()?.simulator()))
    }

    /// A picture of the current state.
    fn draw<'py>(&self, py: Python<'py>, asked: &Bound<'py, PyDict>) -> Result<Bound<'py, PyAny>> {
        let Parts { env, pictures } = &mut *self.parts.lock(py)?;
        let env = env.as_ref().ok_or_else(Error::closed)?;
        pictures.draw(py, &[env], &[], asked)
    }

    /// Frees the simulation and the renderer, after a call that is under way. Later calls raise an
    /// error.
    fn close(&self, py: Python<'_>) -> Result<()> {
        let mut parts = self.parts.lock(py)?;
        parts.env = None;
        parts.pictures.close();
        Ok(())
    }
}

impl Env {
    /// Returns the current observation.
    pub(crate) fn observation(&self, py: Python<'_>) -> Result<FetchObservation> {
        Ok(self.parts.lock(py)?.env()?.observe()?)
    }
}

impl Env {
    /// Raises the exception of the reward of a task in Python.
    fn check(&self) -> Result<()> {
        self.own.as_ref().map_or(Ok(()), |own| own.task.check())
    }
}

impl Parts {
    fn env(&mut self) -> Result<&mut Simulated> {
        self.env.as_mut().ok_or_else(Error::closed)
    }
}
