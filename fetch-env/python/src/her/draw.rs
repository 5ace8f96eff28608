//! Drawing batches as numpy arrays.

use fetch_env::GoalEnv;
use goal_reward::{GoalReward, Symmetry};
use her_relabel::{
    Batch, ColumnsMut, Field, GoalStrategy, Sampler, Transforms, TransitionId, UnitInterval,
};
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use super::own_reward::OwnReward;
use super::{Buffer, Contents, settings};
use crate::error::{Error, Result};
use crate::integer::Integer;
use crate::task::{AnyReward, make};
use crate::warnings::simulate;

#[pymethods]
impl Buffer {
    /// Draws a batch: arrays with a row for each transition. `strategy` and `settings` are JSON. The
    /// new goals have the rewards and the terminations of the settings, or of functions of whole
    /// batches: achieved goals, desired goals and infos.
    #[pyo3(signature = (
        batch_size,
        strategy,
        ratio,
        seed,
        settings = "{}",
        reward = None,
        terminated = None,
    ))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords")]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        batch_size: Integer<usize>,
        strategy: &str,
        ratio: f64,
        seed: Integer<u64>,
        settings: &str,
        reward: Option<Py<PyAny>>,
        terminated: Option<Py<PyAny>>,
    ) -> Result<Bound<'py, PyDict>> {
        let (Integer(batch_size), Integer(seed)) = (batch_size, seed);
        let strategy = settings::parse("strategy", strategy)?;
        let ratio = UnitInterval::new(ratio).map_err(Error::value)?;
        let sampler = self.sampler(Sampler::new(batch_size, strategy, ratio), settings)?;
        let symmetry = match sampler.mirrored() {
            UnitInterval::ZERO => None,
            _ if self.env.is_some() && (reward.is_some() || terminated.is_some()) => {
                return Err(Error::value(
                    "mirrored: a function of your own may judge a mirror image differently, and \
                     mirrored rows keep the reward of their original: leave it out",
                ));
            }
            _ => Some(self.symmetry(py, seed)?),
        };
        let transforms = Transforms { symmetry, ..Transforms::default() };
        let mut contents = self.contents.lock(py)?;
        let Contents { buffer, batch } = &mut *contents;
        let mut draw = |reward: &(dyn GoalReward + Sync)| {
            let columns = ColumnsMut::default();
            py.detach(|| sampler.sample_into(buffer, reward, seed, batch, transforms, columns))
        };
        if reward.is_none() && terminated.is_none() {
            let drawn = draw(&self.reward);
            self.reward.check()?;
            drawn?;
        } else {
            let own = OwnReward::new(reward.as_ref(), terminated.as_ref(), &self.reward);
            let drawn = draw(&own);
            own.into_error().map_or(Ok(()), Err)?;
            self.reward.check()?;
            drawn?;
        }
        columns_of(py, batch, buffer.config().fields())
    }

    /// Raises an error if these are not settings of a draw.
    fn check_sampling(&self, settings: &str) -> Result<()> {
        let sampler = Sampler::new(1, GoalStrategy::Future, UnitInterval::ZERO);
        self.sampler(sampler, settings).map(drop)
    }
}

impl Buffer {
    /// Changes a sampler by settings that JSON names.
    fn sampler(&self, sampler: Sampler, settings: &str) -> Result<Sampler> {
        let sampler = settings::with(sampler, settings)?;
        let keeps_all = sampler.keep_already_achieved() == UnitInterval::ONE;
        if self.env.is_some() || (keeps_all && !sampler.success()) {
            return Ok(sampler);
        }
        Err(Error::value(
            "success and keep_already_achieved: only Fetch tasks have a distance threshold, so \
             leave them out",
        ))
    }

    /// Returns the symmetry of the draw with this seed: those of the environment take turns.
    fn symmetry(&self, py: Python<'_>, seed: u64) -> Result<&Symmetry> {
        let symmetries = match self.symmetries.get() {
            Some(symmetries) => symmetries,
            None => {
                let own = match &self.reward {
                    AnyReward::Own(own) => Some(own),
                    AnyReward::Settings(_) => None,
                };
                let symmetries = simulate(py, || match self.env.clone() {
                    Some(config) => make(config, own).map(|env| env.symmetries()),
                    None => Ok(Vec::new()),
                })?;
                self.symmetries.get_or_init(|| symmetries)
            }
        };
        let turn = seed.checked_rem(symmetries.len() as u64).unwrap_or_default();
        symmetries.get(turn as usize).ok_or_else(|| {
            Error::value(
                "mirrored: nothing says how this environment looks in a mirror: give your task an \
                 attribute mirror, pass mirror= to fetch_env.HerBuffer, or leave it out",
            )
        })
    }
}

/// Returns the columns that a batch has by their names, as arrays that own their memory, and takes
/// them out of the batch.
fn columns_of<'py>(
    py: Python<'py>,
    batch: &mut Batch<f32>,
    fields: &[Field],
) -> Result<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let rows = batch.len();
    let matrix = |key: &str, numbers: Vec<f32>| {
        let shape = [rows, numbers.len() / rows];
        dict.set_item(key, PyArray1::from_vec(py, numbers).reshape(shape)?)
    };
    for field in fields {
        let numbers = batch.field(&field.name).map_err(Error::value)?;
        matrix(&format!("fields_{}", field.name), numbers.to_vec())?;
    }
    let relabeled: Vec<bool> = batch.relabeled().collect();
    let columns = batch.take_columns();
    for (key, numbers) in [
        ("observation", columns.observation),
        ("achieved_goal", columns.achieved_goal),
        ("desired_goal", columns.desired_goal),
        ("action", columns.action),
        ("next_observation", columns.next_observation),
        ("next_achieved_goal", columns.next_achieved_goal),
        ("input", columns.input),
        ("next_input", columns.next_input),
    ] {
        if !numbers.is_empty() {
            matrix(key, numbers)?;
        }
    }
    for (key, numbers) in [
        ("reward", columns.reward),
        ("discount", columns.discount),
        ("importance_weight", columns.importance_weight),
    ] {
        if !numbers.is_empty() {
            dict.set_item(key, PyArray1::from_vec(py, numbers))?;
        }
    }
    for (key, flags) in [
        ("terminated", columns.terminated),
        ("truncated", columns.truncated),
        ("relabeled", relabeled),
        ("success", columns.success),
    ] {
        if !flags.is_empty() {
            dict.set_item(key, PyArray1::from_vec(py, flags))?;
        }
    }
    // Numbers of transitions fit the integers that all tensors have.
    let number = |id: &TransitionId| id.get() as i64;
    let transition = columns.transition.iter().map(number);
    let goal_source = columns.goal_source.iter().map(|id| id.as_ref().map_or(0, number));
    dict.set_item("transition", PyArray1::from_iter(py, transition))?;
    dict.set_item("goal_source", PyArray1::from_iter(py, goal_source))?;
    Ok(dict)
}
