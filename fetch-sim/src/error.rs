use crate::Task;

/// Why a simulation could not be made or could not go on.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene has no object to place.
    #[error("the {task} scene has no object: reset it without an object position")]
    NoObject {
        /// The task whose scene it is.
        task: Task,
    },
    /// The physics diverged.
    #[error("the simulation became unstable ({reason}): reset the environment")]
    Unstable {
        /// What was detected, such as a MuJoCo warning.
        reason: String,
    },
    /// A snapshot of another task, model or version.
    #[error(
        "the snapshot does not fit this simulation ({reason}): restore it into the configuration it was taken from"
    )]
    ForeignSnapshot {
        /// What differs.
        reason: String,
    },
}
