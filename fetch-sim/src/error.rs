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
    /// A buffer of the physics engine overflowed, so that its result is not the model's.
    #[error("the physics ran out of room ({reason}): give the model larger sizes, and reset")]
    BufferFull {
        /// Which buffer.
        reason: String,
    },
    /// MuJoCo's library could not be loaded.
    #[error(
        "MuJoCo could not be loaded from {path} ({reason}): install libmujoco-dev, or build with MUJOCO_DIR naming an installation"
    )]
    Library {
        /// Where the build had found the library.
        path: String,
        /// What the loader said.
        reason: String,
    },
    /// The library is not of the version that the crate was built for.
    #[error(
        "built with the headers of MuJoCo {headers}, but the library is {library}: clean and rebuild with MUJOCO_DIR naming one installation"
    )]
    VersionMismatch {
        /// Version of the headers.
        headers: String,
        /// Version of the library.
        library: String,
    },
    /// A model could not be read or compiled.
    #[error("the model {name} could not be loaded: {reason}")]
    Model {
        /// File name of the model.
        name: String,
        /// MuJoCo's message.
        reason: String,
    },
    /// The files of a model are not there.
    #[error(
        "there is no model at {path}: run `cargo xtask assets`, or set FETCH_ASSETS_DIR to where it put them"
    )]
    NoAssets {
        /// Where it was looked for.
        path: String,
    },
    /// A model lacks something that the Fetch tasks need.
    #[error("the model has no {kind} named {name}: it is not a model of the Fetch tasks")]
    MissingName {
        /// Kind of object, such as `site`.
        kind: &'static str,
        /// The name that was looked up.
        name: String,
    },
    /// MuJoCo reported an error.
    #[error("MuJoCo failed ({message}): reset the environment")]
    Mujoco {
        /// MuJoCo's message.
        message: String,
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
