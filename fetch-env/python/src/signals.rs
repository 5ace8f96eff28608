//! Ctrl-C, and other signals that Python handles, while Rust code runs.

use std::time::{Duration, Instant};

use pyo3::prelude::*;

use crate::error::Result;

/// The time between two looks for signals, each of which waits for the interpreter.
const INTERVAL: Duration = Duration::from_millis(50);

/// The signals of a call that does not hold the interpreter.
///
/// Python runs handlers only on its main thread. On others, a call goes on until its end.
pub(crate) struct Signals {
    looked: Instant,
    raised: Option<PyErr>,
}

impl Signals {
    pub(crate) fn new() -> Self {
        Self { looked: Instant::now(), raised: None }
    }

    /// Looks for signals, unless it has just done so. Returns whether the call goes on: no handler
    /// has raised an exception, such as `KeyboardInterrupt`.
    pub(crate) fn go_on(&mut self) -> bool {
        if self.raised.is_none() && self.looked.elapsed() >= INTERVAL {
            self.raised = Python::attach(|py| py.check_signals()).err();
            self.looked = Instant::now();
        }
        self.raised.is_none()
    }

    /// Returns the exception that a handler has raised.
    pub(crate) fn finish(self) -> Result<()> {
        Ok(self.raised.map_or(Ok(()), Err)?)
    }
}
