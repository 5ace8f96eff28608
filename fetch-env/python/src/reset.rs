//! The seed and the options of a reset.

use fetch_env::FetchResetOptions;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::Numbers;
use crate::config::GOAL_LEN;
use crate::error::{Error, Result};
use crate::variation;

/// Reads the options of a reset, for one environment or for each of several.
pub(crate) fn reset_options(
    options: Option<&Bound<'_, PyDict>>,
    num_envs: Option<usize>,
) -> Result<Vec<FetchResetOptions>> {
    let mut read = FetchResetOptions::default();
    let mut factors = Vec::new();
    for (key, value) in options.into_iter().flatten() {
        let key: String = key.extract()?;
        let numbers = |len| Ok::<_, Error>(Numbers::of_shape(&key, &value, &[len])?.to_double());
        match key.as_str() {
            "desired_goal" => read = read.with_desired_goal(numbers(GOAL_LEN)?),
            "object_position" => {
                let numbers = numbers(2)?;
                read = read.with_object_position([numbers[0], numbers[1]]);
            }
            "variation" => factors = variation::fixed(&value, num_envs)?,
            _ => {
                return Err(Error::value(format!(
                    "there is no reset option {key:?}: the options are \"desired_goal\", \
                     \"object_position\" and \"variation\""
                )));
            }
        }
    }
    let of_env = |env: usize| {
        factors.iter().fold(read.clone(), |read, (factor, values)| {
            read.with_factor(factor.clone(), values[env])
        })
    };
    Ok((0..num_envs.unwrap_or(1)).map(of_env).collect())
}

/// Reads the seed of a reset.
pub(crate) fn seed(seed: Option<&Bound<'_, PyAny>>) -> Result<Option<u64>> {
    let read = |seed: &Bound<'_, PyAny>| {
        seed.extract().map_err(|_| {
            let shown = Error::shown(seed);
            Error::value(format!("the seed is {shown}: pass an integer from 0 to 2**64 - 1"))
        })
    };
    seed.map(read).transpose()
}
