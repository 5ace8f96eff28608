//! Worlds that vary: what is drawn for each episode, and what was drawn.

use fetch_env::variation::{Draw, Factor, Variation, Varied};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList, PyTuple},
};

use crate::arrays::Numbers;
use crate::error::{Error, Result};

/// Reads how numbers are drawn: by name, a number, a range `(low, high)`, or a dictionary of one
/// entry, such as `{"choice": [1, 2, 4]}`.
pub(crate) fn variation(draws: &Bound<'_, PyDict>) -> Result<Variation> {
    draws.iter().try_fold(Variation::default(), |variation, (name, draw)| {
        let name = factor_name(&name)?;
        let draw = read_draw(&name, &draw)?;
        variation.with(name.as_str(), draw).map_err(Error::value)
    })
}

fn factor_name(name: &Bound<'_, PyAny>) -> Result<String> {
    name.extract().map_err(|_| {
        let shown = Error::shown(name);
        Error::value(format!("variation has the key {shown}: pass names, such as \"object_mass\""))
    })
}

fn read_draw(name: &str, draw: &Bound<'_, PyAny>) -> Result<Draw> {
    let wrong = || {
        Error::value(format!(
            "{name} is {}: pass a number, a range (low, high), {{\"log_uniform\": (low, high)}} or \
             {{\"choice\": [...]}}",
            Error::shown(draw)
        ))
    };
    let numbers = |numbers: &Bound<'_, PyAny>| {
        let numbers = Numbers::take(name, numbers)?;
        if numbers.shape().len() == 1 { Ok(numbers.to_double()) } else { Err(wrong()) }
    };
    let range = |range: &Bound<'_, PyAny>| match *numbers(range)? {
        [low, high] => Ok((low, high)),
        _ => Err(wrong()),
    };
    if let Ok(draw) = draw.cast::<PyDict>() {
        let entries: Vec<_> = draw.iter().collect();
        let [(kind, value)] = &entries[..] else { return Err(wrong()) };
        return match kind.extract::<String>().as_deref() {
            Ok("uniform") => range(value).map(|(low, high)| Draw::Uniform(low, high)),
            Ok("log_uniform") => range(value).map(|(low, high)| Draw::LogUniform(low, high)),
            Ok("choice") => numbers(value).map(Draw::Choice),
            _ => Err(wrong()),
        };
    }
    if draw.is_instance_of::<PyTuple>() || draw.is_instance_of::<PyList>() {
        return range(draw).map(|(low, high)| Draw::Uniform(low, high));
    }
    draw.extract().map(Draw::Fixed).map_err(|_| wrong())
}

/// Reads numbers that are set for one episode of each environment: one number for all, or an array of
/// a number for each.
pub(crate) fn fixed(
    numbers: &Bound<'_, PyAny>,
    num_envs: Option<usize>,
) -> Result<Vec<(Factor, Vec<f64>)>> {
    let numbers = numbers.cast::<PyDict>().map_err(|_| {
        let shown = Error::shown(numbers);
        Error::value(format!(
            "variation is {shown}: pass a dictionary, such as {{\"gravity\": 5.0}}"
        ))
    })?;
    let read = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let name = factor_name(&name)?;
        let value = Numbers::take(&name, &value)?;
        let each = match (value.shape(), num_envs) {
            ([], _) => vec![value.to_double()[0]; num_envs.unwrap_or(1)],
            ([count], Some(num_envs)) if *count == num_envs => value.to_double(),
            (_, None) => return Err(Error::value(format!("{name}: pass one number"))),
            (_, Some(num_envs)) => {
                return Err(Error::value(format!("{name}: pass one number, or {num_envs}")));
            }
        };
        Ok((Factor::from(name), each))
    };
    numbers.iter().map(read).collect()
}

/// Returns the numbers of an episode that differ from the model's, by name.
pub(crate) fn varied<'py>(py: Python<'py>, varied: &Varied) -> Result<Bound<'py, PyDict>> {
    let numbers = PyDict::new(py);
    for (name, value) in varied.iter() {
        numbers.set_item(name, value)?;
    }
    Ok(numbers)
}
