//! Errors of a simulation.

use std::{fmt, path::PathBuf};

use crate::task::Task;

/// Error returned when a simulation cannot be created or continued.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SimError {
    /// The scene has no object to place or to change.
    #[error(
        "the {task} scene has no object: reset it without an object position, and leave \
             the object out of its `Extension`"
    )]
    NoObject {
        /// Task of the scene.
        task: Task,
    },
    /// A number that is NaN, or outside the bounds of what can be simulated.
    #[error("{what} is {value:?}: pass a number from {least} to {most}")]
    OutOfRange {
        /// What the number is.
        what: &'static str,
        /// Its value.
        value: f64,
        /// The smallest valid value.
        least: f64,
        /// The largest valid value.
        most: f64,
    },
    /// There is no factor of this name.
    #[error("there is no factor {name}: pass one of {}", known.join(", "))]
    UnknownFactor {
        /// The name.
        name: String,
        /// The names of all factors of its kind.
        known: &'static [&'static str],
    },
    /// A simulation cannot vary a number.
    #[error("{factor} cannot vary here, because {reason}: leave it out")]
    CannotVary {
        /// The factor's name.
        factor: &'static str,
        /// Why not.
        reason: &'static str,
    },
    /// The physics diverged.
    #[error("the simulation became unstable ({reason}): reset the environment")]
    Unstable {
        /// The symptom, such as a MuJoCo warning.
        reason: String,
    },
    /// A buffer of the physics engine overflowed, so the result is not what the model prescribes.
    #[error("the physics ran out of memory ({reason}): set larger sizes in the model, and reset")]
    BufferFull {
        /// The buffer.
        reason: String,
    },
    /// The system gives the process no more memory.
    #[error("there is no memory for {what}: make fewer environments, or give the process more")]
    NoMemory {
        /// What it was for.
        what: String,
    },
    /// The crate was built without MuJoCo's headers.
    #[error(
        "this program was built without MuJoCo: install libmujoco-dev, download one (`cargo xtask \
         mujoco 3.6.0`, or `fetch_sim::download::remember(\"3.6.0\")`, of the feature `download`), \
         or set MUJOCO_DIR to an installation, and build again; or use a `KinematicSimulator`, which \
         needs none"
    )]
    BuiltWithoutMujoco,
    /// MuJoCo's library was not found, or does not fit the headers that the crate was built with.
    #[error(
        "MuJoCo {version}, whose headers this program was built with, could not be loaded ({}): \
         put its library beside the program, set MUJOCO_DIR to an installation, install the \
         system's package (libmujoco-dev has one version), download it with \
         `fetch_sim::download::mujoco(\"{version}\")`, of the feature `download`, or `cargo xtask \
         mujoco {version}`, or build again with another version",
        list(tried)
    )]
    Library {
        /// Version of the headers.
        version: String,
        /// The places in the order of the search, and why each was refused.
        tried: Vec<TriedLibrary>,
    },
    /// `MUJOCO_DIR` names something other than a library that fits the headers that the crate was
    /// built with. Nothing else is tried then, because the variable says which library the user
    /// wants.
    #[error(
        "MUJOCO_DIR is {}, from which MuJoCo {version}, whose headers this program was built with, \
         could not be loaded ({}): unset it, set it to an installation of that version \
         (`fetch_sim::download::mujoco(\"{version}\")`, of the feature `download`, and `cargo \
         xtask mujoco {version}` download one), or build again with it",
        value.display(),
        list(tried)
    )]
    MujocoDir {
        /// The value of the variable.
        value: PathBuf,
        /// Version of the headers.
        version: String,
        /// The libraries in it, and why each was refused.
        tried: Vec<TriedLibrary>,
    },
    /// A library has already been chosen or loaded.
    #[error(
        "MuJoCo is already taken from {}: choose a library once, before the first simulation",
        path.display()
    )]
    LibraryInUse {
        /// The library.
        path: PathBuf,
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
    #[error("the model {name} could not be loaded ({reason}): correct the file")]
    Model {
        /// File name of the model.
        name: String,
        /// MuJoCo's message.
        reason: String,
    },
    /// The files of a model are missing.
    #[error(
        "there is no model at {path}: run `fetch-env assets` (in a clone, `cargo xtask assets`) or \
         call `fetch_sim::download::reference_model`, of the feature `download`, or set \
         FETCH_ASSETS_DIR to where it put them"
    )]
    NoAssets {
        /// The path that was looked up.
        path: String,
    },
    /// A model has nothing of this kind and name.
    #[error(
        "the model has no {kind} named {name}: add it (`ModelSource` lists what the Fetch tasks \
         need), or correct the name"
    )]
    MissingName {
        /// Kind of object, such as `site`.
        kind: &'static str,
        /// The name that was looked up.
        name: String,
    },
    /// A model has a part that the Fetch tasks need, but of the wrong kind.
    #[error("{object} {reason}: use a model of the Fetch tasks")]
    UnfitModel {
        /// The part of the model, such as `the joint object0:joint`.
        object: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A body of the model cannot be shown or placed as an object.
    #[error("the body {body} {reason}")]
    UnfitBody {
        /// The body's name.
        body: String,
        /// Why not, and what to do.
        reason: &'static str,
    },
    /// An id belongs to another model.
    #[error("no {kind} has the id {id} (the model has {count}): use an id of this model")]
    UnknownId {
        /// Kind of object, such as `site`.
        kind: &'static str,
        /// The id.
        id: usize,
        /// The number of such objects in the model.
        count: usize,
    },
    /// A slice does not have the length that the model needs.
    #[error("{what} takes {expected} numbers, not {actual}: pass {expected}")]
    WrongLength {
        /// What the slice is for.
        what: &'static str,
        /// The length that the model needs.
        expected: usize,
        /// The length of the slice.
        actual: usize,
    },
    /// MuJoCo reported an error.
    #[error("MuJoCo failed ({message}): reset the environment")]
    Mujoco {
        /// MuJoCo's message.
        message: String,
    },
    /// The snapshot belongs to another task, model or version.
    #[error(
        "the snapshot does not fit this simulation ({reason}): restore it into the configuration \
         it was taken from"
    )]
    ForeignSnapshot {
        /// The difference.
        reason: String,
    },
}

debug_as_display!(SimError);

/// A library of MuJoCo that was not taken, or a place without one.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct TriedLibrary {
    /// The place, such as `the cache`.
    pub place: &'static str,
    /// The library, if there was one.
    pub path: Option<PathBuf>,
    /// Why it was not taken.
    pub reason: String,
}

impl fmt::Display for TriedLibrary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { place, path, reason } = self;
        match path {
            Some(path) => write!(f, "{place}: {}: {reason}", path.display()),
            None => write!(f, "{place}: {reason}"),
        }
    }
}

fn list(tried: &[TriedLibrary]) -> String {
    tried.iter().map(TriedLibrary::to_string).collect::<Vec<_>>().join("; ")
}
