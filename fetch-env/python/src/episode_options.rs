//! A function of the user's that returns the options of each episode.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use fetch_env::FetchResetOptions;
use pyo3::prelude::*;

use crate::error::{Error, Result};
use crate::reset::options_of_one;
use crate::task::Own;

/// A function that takes the index of an environment and the number of episodes that it has begun, and
/// returns options of a reset or None.
#[derive(Clone)]
pub(crate) struct EpisodeOptions(Arc<Shared>);

struct Shared {
    function: Py<PyAny>,
    /// The task in Python, if there is one.
    own: Option<Own>,
    /// The first error since the last [`check`](EpisodeOptions::check).
    error: Mutex<Option<Error>>,
}

impl EpisodeOptions {
    pub(crate) fn new(function: Py<PyAny>, own: Option<Own>) -> Self {
        Self(Arc::new(Shared { function, own, error: Mutex::default() }))
    }

    /// Returns the options of an environment's next episode.
    pub(crate) fn next(
        &self,
        py: Python<'_>,
        env_index: usize,
        episode: u64,
    ) -> Result<FetchResetOptions> {
        let options = self.0.function.bind(py).call1((env_index, episode))?;
        options_of_one(&options, self.0.own.as_ref())
    }

    /// Returns the options of an episode that begins by itself, on any thread. After an error nothing
    /// is set, and the next [`check`](Self::check) returns it.
    pub(crate) fn choose(&self, env_index: usize, episode: u64) -> FetchResetOptions {
        Python::attach(|py| self.next(py, env_index, episode)).unwrap_or_else(|error| {
            self.error().get_or_insert(error);
            FetchResetOptions::default()
        })
    }

    /// Returns the error of a call on another thread.
    pub(crate) fn check(&self) -> Result<()> {
        self.error().take().map_or(Ok(()), Err)
    }

    fn error(&self) -> MutexGuard<'_, Option<Error>> {
        self.0.error.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
