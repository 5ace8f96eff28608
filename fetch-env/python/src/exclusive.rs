//! Values that Python's threads use one after another.

use std::collections::VecDeque;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};
use std::thread;
use std::time::Duration;

use pyo3::{
    intern,
    prelude::*,
    types::{PyCFunction, PyDict},
};

use crate::error::{Error, Result};

/// How long a thread sleeps before it looks again whether its turn has come: the first time, and at
/// most.
const PAUSES: [Duration; 2] = [Duration::from_micros(20), Duration::from_millis(1)];

/// The number of forks between the process that loaded the module and this one.
static FORKS: AtomicU64 = AtomicU64::new(0);

/// A value that any thread may use, one at a time, in the order in which they ask for it. Waiting
/// threads do not hold the interpreter, and Ctrl-C ends their waiting.
///
/// A process that was forked while another thread used the value never waits for that thread, which
/// it does not have. For this, the line and the value are only taken and left by threads that hold
/// the interpreter, as `os.fork` does.
pub(crate) struct Exclusive<T> {
    value: Mutex<T>,
    line: Mutex<Line>,
}

/// The threads that use a value or wait for it.
#[derive(Default)]
struct Line {
    /// The first one uses the value.
    threads: VecDeque<u64>,
    /// The process, by its number of forks.
    process: u64,
}

impl<T> Exclusive<T> {
    pub(crate) fn new(value: T) -> Self {
        Self { value: Mutex::new(value), line: Mutex::default() }
    }

    /// Waits for this thread's turn. It ends when the guard is dropped.
    pub(crate) fn lock(&self, py: Python<'_>) -> Result<Guard<'_, T>> {
        let turn = Turn::wait_for(&self.line)?;
        let [mut pause, most] = PAUSES;
        while !turn.has_come() {
            py.detach(|| thread::sleep(pause));
            py.check_signals()?;
            pause = most.min(2 * pause);
        }
        let value = match self.value.try_lock() {
            Ok(value) => value,
            Err(TryLockError::Poisoned(error)) => error.into_inner(),
            Err(TryLockError::WouldBlock) => {
                return Err(Error::runtime(
                    "the process was forked while another thread used this object: make a new one",
                ));
            }
        };
        Ok(Guard { value, _turn: turn })
    }
}

/// The exclusive use of a value.
pub(crate) struct Guard<'a, T> {
    value: MutexGuard<'a, T>,
    // Dropped after the value is free.
    _turn: Turn<'a>,
}

impl<T> Deref for Guard<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

impl<T> DerefMut for Guard<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.value
    }
}

/// The place of a thread in a line, which it leaves on drop.
struct Turn<'a> {
    line: &'a Mutex<Line>,
    thread: u64,
}

impl<'a> Turn<'a> {
    fn wait_for(line: &'a Mutex<Line>) -> Result<Self> {
        let thread = this_thread();
        let Line { threads, process } = &mut *look(line);
        let forks = FORKS.load(Relaxed);
        if *process != forks {
            // A fork keeps one thread only.
            threads.retain(|other| *other == thread);
            *process = forks;
        }
        if threads.contains(&thread) {
            return Err(Error::runtime(
                "this object is in use by the call that led to this one: call it afterwards",
            ));
        }
        threads.push_back(thread);
        Ok(Self { line, thread })
    }

    fn has_come(&self) -> bool {
        look(self.line).threads.front() == Some(&self.thread)
    }
}

impl Drop for Turn<'_> {
    fn drop(&mut self) {
        look(self.line).threads.retain(|thread| *thread != self.thread);
    }
}

fn look(line: &Mutex<Line>) -> MutexGuard<'_, Line> {
    line.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns the number of the current thread, which no other has had.
fn this_thread() -> u64 {
    static THREADS: AtomicU64 = AtomicU64::new(0);
    thread_local!(static THREAD: u64 = THREADS.fetch_add(1, Relaxed));
    THREAD.with(|thread| *thread)
}

/// Counts forks from now on.
pub(crate) fn count_forks(py: Python<'_>) -> PyResult<()> {
    let os = py.import("os")?;
    let Ok(register) = os.getattr(intern!(py, "register_at_fork")) else { return Ok(()) };
    let count = PyCFunction::new_closure(py, None, None, |_, _| {
        FORKS.fetch_add(1, Relaxed);
    })?;
    let arguments = PyDict::new(py);
    arguments.set_item("after_in_child", count)?;
    register.call((), Some(&arguments))?;
    Ok(())
}
