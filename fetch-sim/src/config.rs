//! Settings of a simulator.

use serde::{Deserialize, Serialize};

use crate::{assets::ModelSource, bounds::Substeps, task::Task};

/// Settings of a simulator.
///
/// ```
/// use fetch_sim::{ModelSource, SimConfig, Substeps, Task};
///
/// let config = SimConfig::new(Task::Push)
///     .with_n_substeps(Substeps::new(10)?)
///     .with_model(ModelSource::Reference);
/// assert_eq!(config.n_substeps().get(), 10);
/// # Ok::<(), fetch_sim::SimError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[must_use]
pub struct SimConfig {
    task: Task,
    n_substeps: Substeps,
    #[serde(default)]
    model: ModelSource,
    #[serde(default = "on")]
    contact_filter: bool,
}

const fn on() -> bool {
    true
}

impl SimConfig {
    /// Returns the reference's settings for a task: 20 substeps (25 Hz control), the built-in
    /// model.
    pub const fn new(task: Task) -> Self {
        Self {
            task,
            n_substeps: Substeps::REFERENCE,
            model: ModelSource::Builtin,
            contact_filter: true,
        }
    }

    settings! {
        /// Sets the number of physics steps of 0.002 s per control step. The default, 20, gives the
        /// reference's 25 Hz.
        with_n_substeps(n_substeps: Substeps);
        /// Returns the number of physics steps of 0.002 s per control step.
        n_substeps: Substeps;

        /// Sets whether MuJoCo skips collision tests that would find nothing. The default, true, is
        /// faster and gives the same results to the last bit.
        with_contact_filter(contact_filter: bool);
        /// Returns whether MuJoCo skips collision tests that would find nothing.
        contact_filter: bool;
    }

    /// Sets the source of the robot's model. The default is the built-in one, which needs no files.
    pub fn with_model(mut self, model: ModelSource) -> Self {
        self.model = model;
        self
    }

    /// Returns the source of the robot's model.
    #[must_use]
    pub const fn model(&self) -> &ModelSource {
        &self.model
    }

    /// Returns the task whose scene is simulated.
    #[must_use]
    pub const fn task(&self) -> Task {
        self.task
    }

    /// Returns whether both settings give the same steps from the same state.
    pub(crate) fn same_physics(&self, other: &Self) -> bool {
        let Self { task, n_substeps, model, contact_filter: _ } = self;
        *task == other.task && *n_substeps == other.n_substeps && *model == other.model
    }
}
