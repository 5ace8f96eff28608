//! What a call of many environments returns, as arrays.

use fetch_env::{FetchObservation, Info, vec_env::VecStep};
use numpy::{PyArray1, ToPyArray, ndarray::ArrayView2};
use pyo3::{intern, prelude::*, types::PyDict};

use crate::arrays;
use crate::error::Error;

pub(crate) type Steps = VecStep<FetchObservation, Info>;
type Flags<'py> = Bound<'py, PyArray1<bool>>;

/// The results of a step, an element or a row for each environment: observations, rewards, whether
/// the tasks have ended or were cut off, and infos.
pub(crate) type StepTuple<'py> =
    (Bound<'py, PyDict>, Bound<'py, PyArray1<f64>>, Flags<'py>, Flags<'py>, Bound<'py, PyDict>);

/// Returns the results of a step. Python would compute the infos slowly: a step of the simulation
/// displaces the interpreter from the processor's caches.
pub(crate) fn results<'py>(py: Python<'py>, step: &Steps) -> PyResult<StepTuple<'py>> {
    let infos = PyDict::new(py);
    put_successes(py, &infos, step, |started| !started)?;
    let final_info = PyDict::new(py);
    if let Some(ended) = put_successes(py, &final_info, step, |started| started)? {
        infos.set_item("final_obs", final_observations(py, step, &ended)?)?;
        infos.set_item("_final_obs", PyArray1::from_slice(py, &ended))?;
        infos.set_item("final_info", final_info)?;
        infos.set_item("_final_info", PyArray1::from_vec(py, ended))?;
    }
    Ok((
        observations(py, step)?,
        PyArray1::from_slice(py, step.reward()),
        PyArray1::from_slice(py, step.terminated()),
        PyArray1::from_slice(py, step.truncated()),
        infos,
    ))
}

/// Adds the success of each environment that took a step and that is `chosen` by whether it has
/// begun an episode since, and 0 for the others. Returns which ones are chosen, or `None` if none
/// is.
fn put_successes(
    py: Python<'_>,
    info: &Bound<'_, PyDict>,
    step: &Steps,
    chosen: impl Fn(bool) -> bool,
) -> PyResult<Option<Vec<bool>>> {
    let flags: Vec<bool> = step
        .stepped()
        .iter()
        .zip(step.started())
        .map(|(&stepped, &started)| stepped && chosen(started))
        .collect();
    if !flags.contains(&true) {
        return Ok(None);
    }
    let of_chosen = step.success().zip(&flags).map(|(success, &flag)| success && flag);
    let successes = PyArray1::from_iter(py, of_chosen.map(|success| f32::from(u8::from(success))));
    info.set_item(intern!(py, "is_success"), successes)?;
    info.set_item(intern!(py, "_is_success"), PyArray1::from_slice(py, &flags))?;
    Ok(Some(flags))
}

/// Returns the last observations of the episodes that have ended, `None` for the others.
fn final_observations<'py>(
    py: Python<'py>,
    step: &Steps,
    ended: &[bool],
) -> PyResult<Bound<'py, PyArray1<Py<PyAny>>>> {
    let mut all = Vec::with_capacity(ended.len());
    for (env_index, &ended) in ended.iter().enumerate() {
        if !ended {
            all.push(py.None());
            continue;
        }
        let [observation, achieved_goal, desired_goal] =
            [step.next_observation(), step.next_achieved_goal(), step.next_desired_goal()]
                .map(|rows| row(rows, env_index, step.len()));
        let dict = arrays::observation_of(py, observation, [achieved_goal, desired_goal])?;
        all.push(dict.into_any().unbind());
    }
    Ok(PyArray1::from_vec(py, all))
}

/// Returns one of `count` rows of equal lengths.
pub(crate) fn row(rows: &[f64], index: usize, count: usize) -> &[f64] {
    let len = rows.len() / count;
    &rows[index * len..][..len]
}

/// Returns observations as a dictionary of new arrays, a row for each environment.
pub(crate) fn observations<'py>(py: Python<'py>, step: &Steps) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, numbers) in [
        (intern!(py, "achieved_goal"), step.achieved_goal()),
        (intern!(py, "desired_goal"), step.desired_goal()),
        (intern!(py, "observation"), step.observation()),
    ] {
        let shape = (step.len(), numbers.len() / step.len());
        let rows = ArrayView2::from_shape(shape, numbers).map_err(Error::value)?.to_pyarray(py);
        dict.set_item(key, rows)?;
    }
    Ok(dict)
}
