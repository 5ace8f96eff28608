//! Worlds that vary: what is drawn for each episode, and what was drawn.

use fetch_env::variation::{Draw, Factor, Variation, Varied};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList, PyTuple},
};

use crate::arrays::{Numbers, PerEnv};
use crate::error::{Error, Result};

/// Reads how numbers are drawn: by name, a number, a range `(low, high)`, or a dictionary of one
/// entry, such as `{"choice": [1, 2, 4]}`. A color has one for all of red, green and blue, or three.
pub(crate) fn variation(draws: &Bound<'_, PyDict>) -> Result<Variation> {
    draws.iter().try_fold(Variation::default(), |variation, (name, draw)| {
        let name = factor_name(&name)?;
        let factors = factors(&name);
        let each = match draw.is_instance_of::<PyDict>() {
            false => draw.try_iter().and_then(Iterator::collect::<PyResult<Vec<_>>>).ok(),
            true => None,
        };
        let each = each.filter(|each| factors.len() > 1 && each.len() == factors.len());
        factors.into_iter().enumerate().try_fold(variation, |variation, (part, factor)| {
            let draw = each.as_ref().map_or(&draw, |each| &each[part]);
            let draw = read_draw(factor.name(), draw)?;
            variation.with(factor, draw).map_err(Error::value)
        })
    })
}

/// Returns the factor of a name, or the three of a color.
fn factors(name: &str) -> Vec<Factor> {
    let parts = ["red", "green", "blue"].map(|part| Factor::from(format!("{name}_{part}")));
    if parts.iter().all(|part| matches!(part, Factor::Look(_))) {
        parts.into()
    } else {
        vec![name.into()]
    }
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
/// a number for each. Colors have three numbers.
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
    let mut read = Vec::new();
    for (name, value) in numbers.iter() {
        let name = factor_name(&name)?;
        let factors = factors(&name);
        let of_one: &[usize] = if factors.len() == 1 { &[] } else { &[3] };
        let numbers = PerEnv::read(&name, &value, of_one, num_envs)?;
        read.extend(factors.into_iter().enumerate().map(|(part, factor)| {
            let of_env = |env_index: usize| numbers.of(env_index)[part];
            (factor, (0..num_envs.unwrap_or(1)).map(of_env).collect())
        }));
    }
    Ok(read)
}

/// Returns the numbers of an episode that differ from the model's, by name.
pub(crate) fn varied<'py>(py: Python<'py>, varied: &Varied) -> Result<Bound<'py, PyDict>> {
    let numbers = PyDict::new(py);
    for (name, value) in varied.iter() {
        numbers.set_item(name, value)?;
    }
    Ok(numbers)
}
