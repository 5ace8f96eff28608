//! The lengths of observations, goals and actions.

use fetch_env::spaces::{ArrayElement, SpaceError};
use fetch_env::{Dims, Space};

/// Returns the lengths of observations, goals and actions of an environment whose actions are
/// `f32`.
///
/// # Errors
/// As [`Space::dims`].
pub(crate) fn lengths_of(
    observation_space: &Space,
    action_space: &Space,
) -> Result<[usize; 3], SpaceError> {
    // Actions of other elements have no `f32`.
    let action = f32::len_in(action_space).unwrap_or(0);
    let Dims { observation, goal, action } = observation_space.dims(action)?;
    Ok([observation, goal, action])
}
