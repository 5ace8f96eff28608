//! The lengths of a task's vectors.

use serde::{Deserialize, Serialize};

/// The lengths of a task's vectors, in elements; each at least 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Dims {
    /// The length of an observation (without the goals).
    pub observation: usize,
    /// The length of an achieved or a desired goal.
    pub goal: usize,
    /// The length of an action.
    pub action: usize,
}
