//! The settings of an environment, and what follows from them alone: lengths and rewards.

use std::{path::PathBuf, sync::Arc};

use fetch_env::{EnvId, FetchConfig, FetchObservation, ModelSource, RewardKind};
use goal_reward::{GoalPairs, GoalReward, goal_distance};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{
    IntoPyObjectExt,
    prelude::*,
    types::{PyBool, PyDict, PyFloat},
};

use crate::arrays::{Numbers, Shape};
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::task::{AnyReward, AnyTasks, Own, OwnTask, is_of_observations};
use crate::variation;

/// The number of elements of a goal of the built-in tasks: x, y and z.
pub(crate) const GOAL_LEN: usize = 3;
/// The number of elements of an action.
pub(crate) const ACTION_LEN: usize = 4;

/// By how much rewards, and distances in meters, may differ where goals were rounded to `f32`.
const ROUNDING: f64 = 1e-5;

/// The settings of an environment, always valid.
#[pyclass(frozen, module = "fetch_env._native")]
pub(crate) struct Config {
    pub(crate) config: FetchConfig,
    pub(crate) id: EnvId,
    /// The task in Python, if there is one.
    pub(crate) task: Option<Arc<OwnTask>>,
}

#[pymethods]
impl Config {
    #[new]
    #[pyo3(signature = (
        env_id,
        *,
        model = PathBuf::from("builtin"),
        reward_type = None,
        distance_threshold = None,
        n_substeps = None,
        object_range = None,
        target_range = None,
        target_offset = None,
        target_in_the_air = None,
        max_episode_steps = None,
        variation = None,
        task = None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn new(
        env_id: &str,
        model: PathBuf,
        reward_type: Option<&str>,
        distance_threshold: Option<f64>,
        n_substeps: Option<Integer<u32>>,
        object_range: Option<f64>,
        target_range: Option<f64>,
        target_offset: Option<Bound<'_, PyAny>>,
        target_in_the_air: Option<bool>,
        max_episode_steps: Option<Integer<u32>>,
        variation: Option<&Bound<'_, PyDict>>,
        task: Option<&Bound<'_, PyAny>>,
    ) -> Result<Self> {
        let mut id: EnvId = env_id.strip_prefix("fetch_env/").unwrap_or(env_id).parse()?;
        match reward_type {
            None => {}
            Some("sparse") => id.reward = RewardKind::Sparse,
            Some("dense") => id.reward = RewardKind::Dense,
            Some(other) => {
                return Err(Error::value(format!(
                    "there is no reward type {other:?}: pass \"sparse\" or \"dense\""
                )));
            }
        }
        let extension = task.map(OwnTask::extension).transpose()?.flatten();
        let mut config = id.config().with_model(match (model.to_str(), extension) {
            (Some("builtin"), Some(extension)) => ModelSource::Extended(extension),
            (_, Some(_)) => {
                return Err(Error::value("the task extends the built-in model: leave out model"));
            }
            (Some("builtin"), None) => ModelSource::Builtin,
            (Some("reference"), None) => ModelSource::Reference,
            _ => ModelSource::Folder(model),
        });
        if let Some(meters) = distance_threshold {
            config = config.with_distance_threshold(meters)?;
        }
        if let Some(Integer(count)) = n_substeps {
            config = config.with_n_substeps(count)?;
        }
        if let Some(meters) = object_range {
            config = config.with_object_range(meters)?;
        }
        if let Some(meters) = target_range {
            config = config.with_target_range(meters)?;
        }
        if let Some(meters) = target_offset {
            config = config.with_target_offset(offset(&meters)?)?;
        }
        if let Some(in_the_air) = target_in_the_air {
            config = config.with_target_in_the_air(in_the_air)?;
        }
        if let Some(Integer(steps)) = max_episode_steps {
            config = config.with_max_episode_steps(steps)?;
        }
        if let Some(draws) = variation {
            config = config.with_variation(variation::variation(draws)?);
        }
        let task = task.map(OwnTask::new).transpose()?.map(Arc::new);
        Ok(Self { config, id, task })
    }

    /// The name of the environment, such as FetchPush-v4.
    #[getter]
    pub(crate) fn env_id(&self) -> String {
        self.id.to_string()
    }

    /// Number of elements of `observation`.
    #[getter]
    pub(crate) fn observation_len(&self) -> usize {
        let extra = self.task.as_ref().map_or(0, |task| task.extra_len);
        FetchObservation::len_of(self.config.task()) + extra
    }

    /// Number of elements of a goal.
    #[getter]
    pub(crate) fn goal_len(&self) -> usize {
        self.task.as_ref().map_or(GOAL_LEN, |task| task.goal_len)
    }

    /// Duration of a control step, in seconds.
    #[getter]
    fn control_period(&self) -> f64 {
        self.config.control_period()
    }

    /// Distance within which a goal counts as reached, in meters.
    #[getter]
    fn distance_threshold(&self) -> f64 {
        self.config.distance_threshold().get()
    }

    /// "sparse" or "dense".
    #[getter]
    fn reward_type(&self) -> &'static str {
        match self.config.reward() {
            RewardKind::Sparse => "sparse",
            RewardKind::Dense => "dense",
        }
    }

    #[getter]
    fn n_substeps(&self) -> u32 {
        self.config.sim().n_substeps().get()
    }

    /// Largest distance of the object's start in x and y, in meters; None without an object.
    #[getter]
    fn object_range(&self) -> Option<f64> {
        self.config.object_range()
    }

    #[getter]
    fn target_range(&self) -> f64 {
        self.config.target_range()
    }

    #[getter]
    fn target_offset(&self) -> [f64; 3] {
        self.config.target_offset()
    }

    #[getter]
    fn target_in_the_air(&self) -> bool {
        self.config.target_in_the_air()
    }

    #[getter]
    fn has_object(&self) -> bool {
        self.config.task().has_object()
    }

    /// Whether the fingers are held closed.
    #[getter]
    fn block_gripper(&self) -> bool {
        self.config.task().block_gripper()
    }

    /// Height that is added to the gripper's start, in meters.
    #[getter]
    fn gripper_extra_height(&self) -> f64 {
        self.config.task().spec().gripper_extra_height
    }

    /// What makes two transitions of one kind: the task, its reward and its dynamics.
    pub(crate) fn transitions(&self) -> String {
        let (config, sim) = (&self.config, self.config.sim());
        let model = match sim.model() {
            ModelSource::Folder(path) => path.display().to_string(),
            ModelSource::Reference => "reference".to_owned(),
            ModelSource::Extended(extension) => serde_json::json!(extension).to_string(),
            _ => "builtin".to_owned(),
        };
        let variation = match config.variation() {
            variation if variation.is_empty() => String::new(),
            variation => format!(", variation={}", serde_json::json!(variation)),
        };
        let task = self.task.as_ref().map_or_else(String::new, |task| format!(", task={task}"));
        format!(
            "{}, reward_type={:?}, distance_threshold={:?}, n_substeps={}, model={model:?}{variation}{task}",
            EnvId { reward: RewardKind::Sparse, ..self.id },
            self.reward_type(),
            config.distance_threshold().get(),
            sim.n_substeps().get(),
        )
    }

    /// Rewards of pairs of goals: a float for one pair, and otherwise an array of their batch
    /// shape, in the precision that the reference gives it.
    fn compute_reward<'py>(
        &self,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyAny>> {
        let py = achieved_goal.py();
        let goals = Goals::take(achieved_goal, desired_goal, self.goal_len())?;
        let mut rewards = vec![0.0; goals.len()];
        let reward = self.reward();
        let computed = reward.try_reward_batch(goals.pairs()?, &mut rewards);
        reward.check()?;
        computed.map_err(Error::value)?;
        if goals.batch_shape.is_empty() {
            return Ok(PyFloat::new(py, rewards[0]).into_any());
        }
        let is_short = goals.are_single || self.config.reward() == RewardKind::Sparse;
        if is_short && self.task.is_none() {
            let rewards = rewards.iter().map(|&reward| reward as f32);
            let rewards = PyArray1::from_iter(py, rewards);
            return Ok(rewards.reshape(goals.batch_shape)?.into_any());
        }
        Ok(PyArray1::from_vec(py, rewards).reshape(goals.batch_shape)?.into_any())
    }

    /// Raises an error if steps that achieved these goals had other rewards, apart from rounding.
    fn check_rewards(
        &self,
        achieved_goal: &Bound<'_, PyAny>,
        desired_goal: &Bound<'_, PyAny>,
        reward: &Bound<'_, PyAny>,
        is_checked: Vec<bool>,
    ) -> Result<()> {
        if self.task.is_some() {
            // A reward of the user's own may change however little its goals are rounded.
            return Ok(());
        }
        let goals = Goals::take(achieved_goal, desired_goal, self.goal_len())?;
        let rewards = Numbers::of_shape("reward", reward, &goals.batch_shape)?.to_double();
        let expected = self.config.distance_reward();
        let pairs = goals.pairs()?;
        let rows = pairs.iter().zip(rewards).zip(is_checked).enumerate();
        for (row, ((pair, actual), _)) in rows.filter(|(_, (_, is_checked))| *is_checked) {
            let (achieved, desired) = pair;
            let reward = expected.reward(achieved, desired);
            let beyond = goal_distance(achieved, desired) - expected.threshold().get();
            let may_be_either = expected.kind() == RewardKind::Sparse && beyond.abs() < ROUNDING;
            if (actual - reward).abs() > ROUNDING
                && !(may_be_either && [0.0, -1.0].contains(&actual))
            {
                return Err(Error::value(format!(
                    "environment {row} has the reward {actual:?}, but its settings give {reward:?} \
                     for its goals: pass reward=, a function that computes the rewards of a whole \
                     batch, to relabel with"
                )));
            }
        }
        Ok(())
    }

    /// Whether steps with these goals would end the task.
    fn compute_terminated<'py>(
        &self,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyAny>> {
        let reward = self.config.distance_reward();
        flags(achieved_goal, desired_goal, self.goal_len(), |pairs, out| {
            reward.terminated_batch(pairs, out)
        })
    }

    /// Whether steps with these goals would cut the episode off, time limits aside.
    fn compute_truncated<'py>(
        &self,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyAny>> {
        let reward = self.config.distance_reward();
        flags(achieved_goal, desired_goal, self.goal_len(), |pairs, out| {
            reward.truncated_batch(pairs, out)
        })
    }

    /// Whether the achieved goals count as the desired ones.
    fn is_success<'py>(
        &self,
        achieved_goal: &Bound<'py, PyAny>,
        desired_goal: &Bound<'py, PyAny>,
    ) -> Result<Bound<'py, PyAny>> {
        let reward = self.reward();
        flags(achieved_goal, desired_goal, self.goal_len(), |pairs, out| {
            reward.is_success_batch(pairs, out)
        })
    }
}

impl Config {
    /// Returns the task in Python, with its methods called once for many environments or for each.
    pub(crate) fn own(&self, is_together: bool) -> Option<Own> {
        let settings = self.config.distance_reward();
        self.task.clone().map(|task| Own { task, is_together, settings })
    }

    /// Whether observations may be late or noisy.
    pub(crate) fn disturbs(&self) -> bool {
        self.config.variation().iter().any(|(factor, _)| is_of_observations(factor))
    }

    /// Returns what makes environments with the settings' task. A task in Python also has their model,
    /// with the bodies of its own, which the description of a run leaves out.
    pub(crate) fn tasks(&self) -> AnyTasks {
        let task = self.task.clone();
        AnyTasks::new(task.map(|task| (task, Some(self.config.sim().model().clone()))))
    }

    /// Returns the reward of the settings, or of the task in Python.
    pub(crate) fn reward(&self) -> AnyReward {
        let settings = || self.config.distance_reward().into();
        self.own(false).map_or_else(settings, AnyReward::Own)
    }

    /// Refuses a task in Python, for what only the built-in ones can do.
    pub(crate) fn check_built_in(&self, remedy: &str) -> Result<()> {
        let refusal = || Error::value(format!("this is for the built-in tasks: {remedy}"));
        self.task.as_ref().map_or(Ok(()), |_| Err(refusal()))
    }
}

/// Pairs of goals of any batch shape.
struct Goals {
    achieved: Vec<f64>,
    desired: Vec<f64>,
    dim: usize,
    batch_shape: Vec<usize>,
    /// Whether numpy's result would have single precision.
    are_single: bool,
}

impl Goals {
    fn take(
        achieved_goal: &Bound<'_, PyAny>,
        desired_goal: &Bound<'_, PyAny>,
        goal_len: usize,
    ) -> Result<Self> {
        let achieved = Numbers::take("achieved_goal", achieved_goal)?;
        let desired = Numbers::take("desired_goal", desired_goal)?;
        if achieved.shape() != desired.shape() {
            return Err(Error::value(format!(
                "achieved_goal has the shape {:?}, desired_goal {:?}: pass goals of the same shape",
                achieved.shape(),
                desired.shape()
            )));
        }
        let (dim, batch_shape) = match achieved.shape() {
            [batch_shape @ .., dim] if *dim == goal_len => (dim, batch_shape),
            shape => {
                let shape = Shape(shape);
                return Err(Error::value(format!(
                    "the goals have the shape {shape}: pass (..., {goal_len})"
                )));
            }
        };
        Ok(Self {
            achieved: achieved.to_double(),
            desired: desired.to_double(),
            dim: *dim,
            batch_shape: batch_shape.to_vec(),
            are_single: achieved.are_single() && desired.are_single(),
        })
    }

    fn len(&self) -> usize {
        self.batch_shape.iter().product()
    }

    fn pairs(&self) -> Result<GoalPairs<'_>> {
        GoalPairs::new(&self.achieved, &self.desired, self.dim).map_err(Error::value)
    }
}

/// Computes a boolean for each pair: a bool for one pair, and otherwise an array.
fn flags<'py>(
    achieved_goal: &Bound<'py, PyAny>,
    desired_goal: &Bound<'py, PyAny>,
    goal_len: usize,
    compute: impl FnOnce(GoalPairs<'_>, &mut [bool]) -> Result<(), goal_reward::GoalError>,
) -> Result<Bound<'py, PyAny>> {
    let py = achieved_goal.py();
    let goals = Goals::take(achieved_goal, desired_goal, goal_len)?;
    let mut flags = vec![false; goals.len()];
    compute(goals.pairs()?, &mut flags).map_err(Error::value)?;
    if goals.batch_shape.is_empty() {
        return Ok(PyBool::new(py, flags[0]).into_bound_py_any(py)?);
    }
    Ok(PyArray1::from_vec(py, flags).reshape(goals.batch_shape)?.into_any())
}

/// Reads an offset: x, y and z, or one number for all three.
fn offset(meters: &Bound<'_, PyAny>) -> Result<[f64; 3]> {
    let meters = Numbers::take("target_offset", meters)?;
    match (meters.shape(), &*meters.to_double()) {
        ([], &[all]) => Ok([all; 3]),
        ([_], &[x, y, z]) => Ok([x, y, z]),
        (shape, _) => Err(Error::value(format!(
            "target_offset has the shape {shape:?}: pass x, y and z, or one number for all three"
        ))),
    }
}
