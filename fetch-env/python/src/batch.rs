//! Batches of the replay buffer as numpy arrays.

use her_relabel::Columns;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use crate::error::Result;

/// Returns the columns of a batch by their names, as arrays that own their memory.
pub(crate) fn columns_of<'py>(
    py: Python<'py>,
    batch_size: usize,
    columns: Columns<f32>,
    relabeled: Vec<bool>,
) -> Result<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for (key, numbers) in [
        ("observation", columns.observation),
        ("achieved_goal", columns.achieved_goal),
        ("desired_goal", columns.desired_goal),
        ("action", columns.action),
        ("next_observation", columns.next_observation),
        ("next_achieved_goal", columns.next_achieved_goal),
    ] {
        let shape = [batch_size, numbers.len() / batch_size];
        dict.set_item(key, PyArray1::from_vec(py, numbers).reshape(shape)?)?;
    }
    dict.set_item("reward", PyArray1::from_vec(py, columns.reward))?;
    for (key, flags) in [
        ("terminated", columns.terminated),
        ("truncated", columns.truncated),
        ("relabeled", relabeled),
    ] {
        dict.set_item(key, PyArray1::from_vec(py, flags))?;
    }
    Ok(dict)
}
