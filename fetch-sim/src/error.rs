//! Errors of a simulation.

use crate::task::Task;

/// Error returned when a simulation cannot be created or continued.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene has no object to place.
    #[error("the {task} scene has no object: reset it without an object position")]
    NoObject {
        /// Task of the scene.
        task: Task,
    },
    /// The physics diverged.
    #[error("the simulation became unstable ({reason}): reset the environment")]
    Unstable {
        /// The symptom, such as a MuJoCo warning.
        reason: String,
    },
    /// A buffer of the physics engine overflowed, so that its result is not the model's.
    #[error("the physics ran out of room ({reason}): give the model larger sizes, and reset")]
    BufferFull {
        /// The buffer.
        reason: String,
    },
    /// MuJoCo's library could not be loaded.
    #[error(
        "MuJoCo could not be loaded from {path} ({reason}): install libmujoco-dev, or build with MUJOCO_DIR naming an installation"
    )]
    Library {
        /// Path of the library that the build found.
        path: String,
        /// Message of the loader.
        reason: String,
    },
    /// The library's version is not the one that the crate was built for.
    #[error(
        "built with the headers of MuJoCo {headers}, but the library is {library}: clean and rebuild with MUJOCO_DIR naming one installation"
    )]
    VersionMismatch {
        /// Version of the headers.
        headers: String,
        /// Version of the library.
        library: String,
    },
    /// The crate's C and Rust sides were compiled from different sources.
    #[error("{item} is {shim} in the C shim and {rust} in Rust: clean and rebuild")]
    ShimMismatch {
        /// The number, struct or field that differs.
        item: String,
        /// Its value (a field's is its offset) and size in C.
        shim: String,
        /// Its value and size in Rust.
        rust: String,
    },
    /// A model could not be read or compiled.
    #[error("the model {name} could not be loaded ({reason}): correct its file")]
    Model {
        /// File name of the model.
        name: String,
        /// MuJoCo's message.
        reason: String,
    },
    /// The files of a model are missing.
    #[error(
        "there is no model at {path}: run `cargo xtask assets`, or set FETCH_ASSETS_DIR to where it put them"
    )]
    NoAssets {
        /// The path that was looked up.
        path: String,
    },
    /// A model lacks something that the Fetch tasks need.
    #[error("the model has no {kind} named {name}: use a model of the Fetch tasks")]
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
    /// The snapshot belongs to another task, model or version.
    #[error(
        "the snapshot does not fit this simulation ({reason}): restore it into the configuration it was taken from"
    )]
    ForeignSnapshot {
        /// The difference.
        reason: String,
    },
}
