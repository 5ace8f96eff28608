use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use crate::{ModelSource, Task};

/// What a simulator is made from.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SimConfig {
    /// The task whose scene is simulated.
    pub task: Task,
    /// Physics steps of 0.002 s per control step.
    pub n_substeps: NonZeroU32,
    /// Where the model comes from.
    #[serde(default)]
    pub model: ModelSource,
    /// Whether collision tests that would find nothing are left out: faster, and the same to the
    /// last bit.
    #[serde(default = "on")]
    pub contact_filter: bool,
}

const fn on() -> bool {
    true
}

impl SimConfig {
    /// The reference's configuration (20 substeps, 25 Hz control) of the built-in model.
    #[must_use]
    pub const fn new(task: Task) -> Self {
        Self {
            task,
            n_substeps: NonZeroU32::new(20).expect("20 is not 0"),
            model: ModelSource::Builtin,
            contact_filter: true,
        }
    }

    /// Whether the same steps follow from the same state.
    pub(crate) fn same_physics(&self, other: &Self) -> bool {
        let Self { task, n_substeps, model, contact_filter: _ } = self;
        *task == other.task && *n_substeps == other.n_substeps && *model == other.model
    }
}
