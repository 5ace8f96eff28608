//! Equality to the last bit.

use std::fmt::Debug;

use super::report::{Failure, ensure};
use super::subject::{Checked, ResetOf, StepOf};
use crate::gym::spaces::Value;
use crate::gym::{env::observation::BatchObservation, error::EnvError};

/// Whether two vectors are equal to the last bit: unlike `==`, it distinguishes -0.0 from 0.0, and
/// equal NaNs are equal.
#[must_use]
pub fn same_bits(a: &[f64], b: &[f64]) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
}

/// Whether two observations of an environment are equal to the last bit.
pub(super) fn same_observation<E: Checked>(
    env: &E,
    a: &E::Observation,
    b: &E::Observation,
) -> Result<bool, EnvError> {
    let space = env.observation_space();
    Ok(same_value(&a.to_value(space)?, &b.to_value(space)?))
}

fn same_value(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::F64(a), Value::F64(b)) => same_bits(a, b),
        (Value::F32(a), Value::F32(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
        }
        (Value::Dict(a), Value::Dict(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.0 == b.0 && same_value(&a.1, &b.1))
        }
        (a, b) => a == b,
    }
}

/// Whether two infos are equal. Their texts tell -0.0 from 0.0, and equal NaNs are equal.
fn same_info<I: Debug>(a: &I, b: &I) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

/// Fails unless two resets are equal to the last bit.
pub(super) fn ensure_same_reset<E: Checked>(
    what: &str,
    env: &E,
    a: &ResetOf<E>,
    b: &ResetOf<E>,
) -> Result<(), Failure> {
    let same =
        same_observation(env, &a.observation, &b.observation)? && same_info(&a.info, &b.info);
    ensure(same, || format!("{what} differ: {a:?} and {b:?}"))
}

/// Fails unless two trajectories are equal to the last bit.
pub(super) fn ensure_same_steps<E: Checked>(
    env: &E,
    a: &[StepOf<E>],
    b: &[StepOf<E>],
) -> Result<(), Failure> {
    ensure(a.len() == b.len(), || format!("{} steps and {}", a.len(), b.len()))?;
    for (index, (a, b)) in a.iter().zip(b).enumerate() {
        let same = same_observation(env, &a.observation, &b.observation)?
            && same_bits(&[a.reward], &[b.reward])
            && (a.terminated, a.truncated) == (b.terminated, b.truncated)
            && same_info(&a.info, &b.info);
        ensure(same, || format!("step {index} differs: {a:?} and {b:?}"))?;
    }
    Ok(())
}
