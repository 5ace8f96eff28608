use std::{num::NonZeroUsize, thread};

use serde::{Deserialize, Serialize};

/// When an environment whose episode is over starts the next one.
///
/// The modes are Gymnasium's. An environment that has failed counts as one whose episode is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AutoresetMode {
    /// The next step resets it instead: its action is ignored, its reward is 0, and nothing ends.
    #[default]
    NextStep,
    /// The step that ends the episode resets it as well: observation and info are the next
    /// episode's first, [`Batch::final_step`](super::Batch::final_step) has the last ones.
    SameStep,
    /// Never: a reset with a [mask](super::VecReset::mask) does it, and a step before is
    /// [`EnvError::EpisodeOver`](crate::EnvError::EpisodeOver).
    Disabled,
}

/// How a [`VecEnv`](super::VecEnv) works.
///
/// ```
/// use fetch_env::vec_env::{AutoresetMode, VecConfig};
///
/// let config = VecConfig::default().threads(2).autoreset(AutoresetMode::SameStep);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use]
pub struct VecConfig {
    pub(super) threads: Option<NonZeroUsize>,
    pub(super) autoreset: AutoresetMode,
    pub(super) pin_threads: bool,
}

impl VecConfig {
    /// The number of worker threads; by default, and for 0, one for each core. There are never more
    /// threads than environments.
    pub const fn threads(mut self, threads: usize) -> Self {
        self.threads = NonZeroUsize::new(threads);
        self
    }

    /// When episodes start anew; [`AutoresetMode::NextStep`] by default.
    pub const fn autoreset(mut self, mode: AutoresetMode) -> Self {
        self.autoreset = mode;
        self
    }

    /// Whether each worker thread keeps to a core of its own, the first to the first; off by
    /// default. It helps where nothing else runs on the machine, and harms elsewhere.
    pub const fn pin_threads(mut self, pin: bool) -> Self {
        self.pin_threads = pin;
        self
    }

    pub(crate) fn num_threads(&self, num_envs: usize) -> usize {
        let cores = || thread::available_parallelism().map_or(1, NonZeroUsize::get);
        self.threads.map_or_else(cores, NonZeroUsize::get).min(num_envs)
    }
}
