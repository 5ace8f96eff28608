//! The crates' errors as Python exceptions, with remedies for Python.

use std::{fmt::Display, io, iter::successors, path::Path};

use fetch_env::{EnvError, MakeError, RenderError, SimError, vec_env::VecEnvError};
use her_relabel::{AddError, PriorityError, RefusedRow, SampleError};
use pyo3::{
    create_exception,
    exceptions::{PyMemoryError, PyOSError, PyRuntimeError, PyTypeError, PyValueError},
    prelude::*,
    sync::PyOnceLock,
    types::PyType,
};

/// What prevents errors of forked processes.
const SPAWN: &str = "start processes with context=\"spawn\", which AsyncVectorEnv also takes";

/// The remedy of a buffer without priorities.
const NO_PRIORITIES: &str = "the buffer has no priorities: make it with \
                             HerBuffer(..., priorities={\"unit\": \"transition\"})";

create_exception!(
    fetch_env,
    SimulationError,
    PyRuntimeError,
    "A simulation failed: it became unstable, or MuJoCo reported an error. Reset the environment."
);
create_exception!(
    fetch_env,
    MujocoError,
    PyOSError,
    "MuJoCo's library could not be loaded, or does not fit the package."
);

/// An error of the crates, on its way to Python.
pub(crate) struct Error(PyErr);

/// The result of a call that Python makes.
pub(crate) type Result<T, E = Error> = std::result::Result<T, E>;

impl From<Error> for PyErr {
    fn from(Error(error): Error) -> Self {
        error
    }
}

impl From<PyErr> for Error {
    fn from(error: PyErr) -> Self {
        Self(error)
    }
}

impl Error {
    /// Returns the error of an invalid argument.
    pub(crate) fn value(message: impl Display) -> Self {
        Self(PyValueError::new_err(message.to_string()))
    }

    /// Returns an error with all its causes: the environment's own if that has failed, the file
    /// system's if that has, and otherwise the error of an argument.
    pub(crate) fn chain(error: impl std::error::Error + 'static) -> Self {
        Self::of_chain(&error)
    }

    fn of_chain(error: &(dyn std::error::Error + 'static)) -> Self {
        let causes: Vec<_> = successors(Some(error), |cause| cause.source()).collect();
        if let Some(error) = causes.iter().find_map(|cause| cause.downcast_ref::<EnvError>()) {
            return error.clone().into();
        }
        let message = causes.iter().map(ToString::to_string).collect::<Vec<_>>().join(": ");
        let mut files = causes.iter().filter_map(|cause| cause.downcast_ref::<io::Error>());
        let Some(error) = files.next() else { return Self::value(message) };
        let of_system = files.chain([error]).find_map(io::Error::raw_os_error);
        let message = match of_system {
            Some(number) => message.replace(&format!(" (os error {number})"), ""),
            None => message,
        };
        // Windows has numbers of its own.
        let number = of_system.filter(|_| cfg!(unix)).unwrap_or_else(|| number_of(error.kind()));
        // Python makes a FileNotFoundError, or what else the number means.
        Self(PyOSError::new_err((number, message)))
    }

    /// Names the file, if this is an error of the file system.
    pub(crate) fn at(self, path: &Path) -> Self {
        let named = Python::attach(|py| {
            let error = self.0.value(py);
            let is_of_files = error.is_instance_of::<PyOSError>();
            if is_of_files { error.setattr("filename", path.as_os_str()) } else { Ok(()) }
        });
        named.map_or_else(Self, |()| self)
    }

    /// Returns a number or a text as messages show it: not all digits of a long one.
    pub(crate) fn shown(value: &Bound<'_, PyAny>) -> String {
        const MOST: usize = 18;
        let text = value.str().map_or_else(|_| "a long number".to_owned(), |text| text.to_string());
        match text.char_indices().nth(MOST) {
            Some((end, _)) => format!("{}...", &text[..end]),
            None => text,
        }
    }

    /// Returns the error of a call at the wrong time, or in the wrong process.
    pub(crate) fn runtime(message: impl Display) -> Self {
        Self(PyRuntimeError::new_err(message.to_string()))
    }

    /// Names the argument that numpy cannot convert. Errors of Python code that numpy calls stay
    /// as they are.
    pub(crate) fn argument(name: &str, error: PyErr) -> Self {
        Python::attach(|py| {
            let message = format!("{name}: {}", error.value(py));
            if error.is_instance_of::<PyTypeError>(py) {
                Self(PyTypeError::new_err(message))
            } else if error.is_instance_of::<PyValueError>(py) {
                Self::value(message)
            } else {
                Self(error)
            }
        })
    }

    /// Says in the message which environment has failed.
    pub(crate) fn of_env(self, env_index: usize) -> Self {
        Self(Python::attach(|py| {
            let message = format!("environment {env_index}: {}", self.0.value(py));
            PyErr::from_type(self.0.get_type(py), message)
        }))
    }

    /// Returns the error of a call of a closed environment.
    pub(crate) fn closed() -> Self {
        static TYPE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
        gymnasium_error(&TYPE, "ClosedEnvironmentError", "the environment is closed: make another")
    }
}

/// Returns the number of an error that does not come from the system itself.
const fn number_of(kind: io::ErrorKind) -> i32 {
    const INPUT_OUTPUT: i32 = 5;
    match kind {
        io::ErrorKind::NotFound => 2,
        io::ErrorKind::PermissionDenied => 13,
        io::ErrorKind::AlreadyExists => 17,
        io::ErrorKind::IsADirectory => 21,
        io::ErrorKind::InvalidInput => 22,
        io::ErrorKind::StorageFull => 28,
        _ => INPUT_OUTPUT,
    }
}

/// Returns one of Gymnasium's exceptions.
fn gymnasium_error(
    kind: &'static PyOnceLock<Py<PyType>>,
    name: &str,
    message: impl Display,
) -> Error {
    Error(Python::attach(|py| match kind.import(py, "gymnasium.error", name) {
        Ok(kind) => PyErr::from_type(kind.clone(), message.to_string()),
        Err(error) => error,
    }))
}

impl From<EnvError> for Error {
    fn from(error: EnvError) -> Self {
        if let Some(error) = error.downcast_ref::<PyErr>() {
            return Self(Python::attach(|py| error.clone_ref(py)));
        }
        if let Some(error) = error.downcast_ref::<SimError>() {
            return error.clone().into();
        }
        if let Some(error) = error.downcast_ref::<MakeError>() {
            return error.clone().into();
        }
        if let Some(error) = error.downcast_ref::<VecEnvError>() {
            return error.clone().into();
        }
        if let Some(error) = error.downcast_ref::<RenderError>() {
            return error.clone().into();
        }
        match error {
            EnvError::ResetNeeded | EnvError::EpisodeOver => {
                static TYPE: PyOnceLock<Py<PyType>> = PyOnceLock::new();
                gymnasium_error(&TYPE, "ResetNeeded", error)
            }
            EnvError::Entropy { .. } | EnvError::Panicked { .. } => Self::runtime(error),
            error => Self::value(error),
        }
    }
}

impl From<MakeError> for Error {
    fn from(error: MakeError) -> Self {
        match error {
            MakeError::Sim(error) => error.into(),
            MakeError::Vec(error) => error.into(),
            error => Self::value(error),
        }
    }
}

impl From<VecEnvError> for Error {
    fn from(error: VecEnvError) -> Self {
        match error {
            VecEnvError::ResetNeeded { .. } => EnvError::ResetNeeded.into(),
            VecEnvError::InFlight { .. } => Self::runtime(
                "a step is under way: call step_wait() before another step, reset or change",
            ),
            VecEnvError::Forked => Self::runtime(format_args!("{error}, or {SPAWN}")),
            VecEnvError::Thread { .. } | VecEnvError::OutOfUse { .. } | VecEnvError::WorkerLost => {
                Self::runtime(error)
            }
            error => Self::value(error),
        }
    }
}

impl From<SimError> for Error {
    fn from(error: SimError) -> Self {
        const LIBRARY: &str = "install the package again";
        match error {
            SimError::NoAssets { path } => Self(PyOSError::new_err((
                number_of(io::ErrorKind::NotFound),
                "there is no such model: call fetch_env.download_reference_model() once, or pass \
                 the folder of its scenes as model",
                path,
            ))),
            SimError::NoObject { task } => {
                Self::value(format!("{task} has no object: leave out \"object_position\""))
            }
            SimError::MissingName { kind, name } => Self::value(format!(
                "the model has no {kind} named {name}: add it, or correct the name"
            )),
            SimError::BuiltWithoutMujoco => Self(MujocoError::new_err(
                "fetch_env was built without MuJoCo's headers: install it again from a wheel",
            )),
            SimError::Library { version, tried } | SimError::MujocoDir { version, tried, .. } => {
                let tried: Vec<_> = tried.iter().map(ToString::to_string).collect();
                Self(MujocoError::new_err(format!(
                    "MuJoCo {version} could not be loaded ({}): {LIBRARY}",
                    tried.join("; ")
                )))
            }
            SimError::ShimMismatch { .. } | SimError::LibraryInUse { .. } => {
                Self(MujocoError::new_err(error.to_string()))
            }
            SimError::NoMemory { .. } => Self(PyMemoryError::new_err(error.to_string())),
            SimError::Unstable { .. } | SimError::BufferFull { .. } | SimError::Mujoco { .. } => {
                Self(SimulationError::new_err(error.to_string()))
            }
            error => Self::value(error),
        }
    }
}

impl From<RenderError> for Error {
    fn from(error: RenderError) -> Self {
        match error {
            RenderError::Size { .. }
            | RenderError::UnknownCamera { .. }
            | RenderError::FreeCamera { .. } => Self::value(error),
            RenderError::Sim(error) => error.into(),
            RenderError::Forked => Self::runtime(format_args!("{error}, or {SPAWN}")),
            RenderError::Failed { message } => {
                Self::runtime(format!("rendering failed ({message}): try it again"))
            }
            error => Self::runtime(error),
        }
    }
}

impl From<serde_json::Error> for Error {
    fn from(error: serde_json::Error) -> Self {
        Self::value(format!("this is not a state of an environment: {error}"))
    }
}

impl From<AddError> for Error {
    fn from(error: AddError) -> Self {
        match error {
            AddError::UnknownField(error) => Self::value(format!(
                "there is no field {:?} among [{}]: name all fields in HerBuffer(..., fields=...)",
                error.name,
                error.known.join(", ")
            )),
            error => Self::value(error),
        }
    }
}

impl From<RefusedRow> for Error {
    fn from(error: RefusedRow) -> Self {
        Self::value(error)
    }
}

impl From<PriorityError> for Error {
    fn from(error: PriorityError) -> Self {
        match error {
            PriorityError::NoPriorities => Self::value(NO_PRIORITIES),
            error => Self::value(error),
        }
    }
}

impl From<SampleError> for Error {
    fn from(error: SampleError) -> Self {
        match error {
            SampleError::NoPriorities => Self::value(NO_PRIORITIES),
            error => Self::value(error),
        }
    }
}
