//! The seed and the options of a reset.

use fetch_env::FetchResetOptions;
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::arrays::PerEnv;
use crate::config::GOAL_LEN;
use crate::error::{Error, Result};
use crate::task::Own;
use crate::variation;

const OPTIONS: &str = "\"desired_goal\", \"gripper_position\", \"object_height\", \
                       \"object_in_gripper\", \"object_position\", \"object_rotation\" and \
                       \"variation\"";

/// Reads the options of a reset of one environment.
pub(crate) fn reset_options(
    options: Option<&Bound<'_, PyDict>>,
    own: Option<&Own>,
) -> Result<FetchResetOptions> {
    read(options, None, own).map(|mut of_each| of_each.remove(0))
}

/// Reads the options of a reset of each environment: a dictionary with numbers for all or for each,
/// or a list of a dictionary or None for each.
pub(crate) fn options_of_each(
    options: Option<&Bound<'_, PyAny>>,
    num_envs: usize,
    own: Option<&Own>,
) -> Result<Vec<FetchResetOptions>> {
    let Some(options) = options.filter(|options| !options.is_none()) else {
        return read(None, Some(num_envs), own);
    };
    let Ok(of_each) = options.cast::<PyList>() else {
        let one = options.cast::<PyDict>().map_err(|_| {
            Error::value(format!(
                "options is {}: pass a dictionary, or a list of one for each environment",
                Error::shown(options)
            ))
        })?;
        return read(Some(one), Some(num_envs), own);
    };
    if of_each.len() != num_envs {
        let len = of_each.len();
        return Err(Error::value(format!(
            "there are options of {len} environments: pass {num_envs}"
        )));
    }
    of_each.iter().map(|options| options_of_one(&options, own)).collect()
}

/// Reads a dictionary of options, or None.
pub(crate) fn options_of_one(
    options: &Bound<'_, PyAny>,
    own: Option<&Own>,
) -> Result<FetchResetOptions> {
    if options.is_none() {
        return Ok(FetchResetOptions::default());
    }
    let one = options.cast::<PyDict>().map_err(|_| {
        let shown = Error::shown(options);
        Error::value(format!(
            "the options of an environment are {shown}: pass a dictionary or None"
        ))
    })?;
    reset_options(Some(one), own)
}

fn read(
    options: Option<&Bound<'_, PyDict>>,
    num_envs: Option<usize>,
    own: Option<&Own>,
) -> Result<Vec<FetchResetOptions>> {
    let mut all = vec![FetchResetOptions::default(); num_envs.unwrap_or(1)];
    for (key, value) in options.into_iter().flatten() {
        let key: String = key.extract()?;
        let mut set =
            |shape: &[usize], set: &dyn Fn(FetchResetOptions, &[f64]) -> FetchResetOptions| {
                let numbers = PerEnv::read(&key, &value, shape, num_envs)?;
                for (env_index, options) in all.iter_mut().enumerate() {
                    *options = set(std::mem::take(options), numbers.of(env_index));
                }
                Ok::<_, Error>(())
            };
        match key.as_str() {
            "desired_goal" => {
                let goal_len = own.map_or(GOAL_LEN, |own| own.task.goal_len);
                set(&[goal_len], &|options, goal| options.with_desired_goal(goal))?;
            }
            "object_position" => {
                set(&[2], &|options, place| options.with_object_position([place[0], place[1]]))?;
            }
            "object_height" => set(&[], &|options, height| options.with_object_height(height[0]))?,
            "object_rotation" => {
                set(&[4], &|options, q| options.with_object_rotation([q[0], q[1], q[2], q[3]]))?
            }
            "gripper_position" => set(&[3], &|options, place| {
                options.with_gripper_position([place[0], place[1], place[2]])
            })?,
            "object_in_gripper" => {
                set(&[], &|options, held| options.with_object_in_gripper(held[0] != 0.0))?
            }
            "variation" => {
                for (factor, numbers) in variation::fixed(&value, num_envs)? {
                    own.map_or(Ok(()), |own| own.check(&factor))?;
                    for (options, number) in all.iter_mut().zip(numbers) {
                        *options = std::mem::take(options).with_factor(factor.clone(), number);
                    }
                }
            }
            _ => {
                let message =
                    format!("there is no reset option {key:?}: the options are {OPTIONS}");
                return Err(Error::value(message));
            }
        }
    }
    Ok(all)
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
