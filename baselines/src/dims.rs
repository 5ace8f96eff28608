//! The lengths of observations, goals and actions.

use fetch_env::Space;
use fetch_env::spaces::{ArrayElement, SpaceError};
use her_relabel::Dims;

/// Returns the lengths of an environment's observations and goals, with that of its actions.
///
/// # Errors
/// [`SpaceError::MissingPart`] if the space has no observation or no goals of `f32` or `f64`.
pub(crate) fn dims_of(observation_space: &Space, action: usize) -> Result<Dims, SpaceError> {
    let dict = observation_space.as_dict();
    let len = |key| {
        let part = dict.and_then(|dict| dict.get(key));
        let len = part.and_then(|part| f32::len_in(part).or_else(|| f64::len_in(part)));
        len.ok_or(SpaceError::MissingPart { key, element: "f32 or f64" })
    };
    Ok(Dims { observation: len("observation")?, goal: len("desired_goal")?, action })
}

/// Returns the lengths of observations, goals and actions of an environment whose actions are
/// `f32`.
///
/// # Errors
/// As [`dims_of`].
pub(crate) fn lengths_of(
    observation_space: &Space,
    action_space: &Space,
) -> Result<[usize; 3], SpaceError> {
    // Actions of other elements have no `f32`.
    let action = f32::len_in(action_space).unwrap_or(0);
    let dims = dims_of(observation_space, action)?;
    Ok([dims.observation, dims.goal, dims.action])
}
