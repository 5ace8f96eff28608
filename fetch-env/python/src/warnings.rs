//! MuJoCo's warnings as Python's.

use std::{
    ffi::CString,
    mem,
    sync::{Mutex, MutexGuard},
    thread,
};

use pyo3::{create_exception, exceptions::PyUserWarning, prelude::*};
use tracing::{
    Event, Metadata, Subscriber,
    field::{Field, Visit},
    span::{Attributes, Id, Record},
    subscriber::set_global_default,
};

use crate::error::{Error, Result};

create_exception!(
    fetch_env,
    MujocoWarning,
    PyUserWarning,
    "MuJoCo warns about a model or a simulation."
);

/// Warnings of all threads that were not yet passed on to Python.
static PENDING: Mutex<Vec<String>> = Mutex::new(Vec::new());
/// The largest number of warnings that wait; later ones are dropped.
const MOST_PENDING: usize = 64;

/// Locks the warnings, but not at any price: in a forked process, a thread that only its parent has
/// may have locked them for ever, and they are given up.
fn pending() -> Option<MutexGuard<'static, Vec<String>>> {
    const ATTEMPTS: usize = 1000;
    (0..ATTEMPTS).find_map(|_| PENDING.try_lock().map_err(|_| thread::yield_now()).ok())
}

/// Runs a simulation without holding the interpreter, and passes on MuJoCo's warnings. An error of
/// the call takes precedence over a warning that Python's filters turn into an error.
pub(crate) fn simulate<T, E>(
    py: Python<'_>,
    call: impl FnOnce() -> Result<T, E> + Send,
) -> Result<T>
where
    T: Send,
    E: Into<Error> + Send,
{
    let result = py.detach(call);
    pass_on(py, result.map_err(Into::into))
}

/// Passes on MuJoCo's warnings after a call with this result. Its error takes precedence over a
/// warning that Python's filters turn into an error.
pub(crate) fn pass_on<T>(py: Python<'_>, result: Result<T>) -> Result<T> {
    let warned = warn(py);
    let value = result?;
    warned?;
    Ok(value)
}

fn warn(py: Python<'_>) -> Result<()> {
    let mut all = Ok(());
    let texts = pending().map(|mut texts| mem::take(&mut *texts));
    for text in texts.into_iter().flatten() {
        let text = CString::new(text).map_err(Error::value)?;
        // Level 1 is the package's own line.
        let warned = PyErr::warn(py, &py.get_type::<MujocoWarning>(), &text, 2);
        all = all.and(warned);
    }
    Ok(all?)
}

/// Collects the warnings from now on. If several interpreters load this module, the first one does.
pub(crate) fn collect() {
    let _ = set_global_default(Collector);
}

struct Collector;

impl Subscriber for Collector {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        metadata.target() == "mujoco"
    }

    fn event(&self, event: &Event<'_>) {
        let mut message = Message(String::new());
        event.record(&mut message);
        if let Some(mut texts) = pending().filter(|texts| texts.len() < MOST_PENDING) {
            texts.push(message.0);
        }
    }

    // There are no spans.
    fn new_span(&self, _: &Attributes<'_>) -> Id {
        Id::from_u64(1)
    }
    fn record(&self, _: &Id, _: &Record<'_>) {}
    fn record_follows_from(&self, _: &Id, _: &Id) {}
    fn enter(&self, _: &Id) {}
    fn exit(&self, _: &Id) {}
}

/// The text of an event.
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn std::fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}
