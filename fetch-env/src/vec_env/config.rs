//! How environments are stepped together, and how they are reset.

use std::{num::NonZeroUsize, thread};

use serde::{Deserialize, Serialize};

use crate::error::VecEnvError;
use crate::settings::{getters, setters};

/// When the next episode starts after the end of one.
///
/// The modes are Gymnasium's. An environment that failed counts as one whose episode is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AutoresetMode {
    /// The next step resets the environment instead: it ignores its action, gives reward 0 and ends
    /// nothing.
    #[default]
    NextStep,
    /// The step that ends the episode also resets the environment: observation and info are the
    /// next episode's first, [`Batch::final_step`](super::Batch::final_step) has the last ones.
    SameStep,
    /// Never: the caller resets with a [mask](VecReset::mask). A step before that is
    /// [`EnvError::EpisodeOver`](crate::EnvError::EpisodeOver).
    Disabled,
}

/// Settings of a [`VecEnv`](super::VecEnv).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[must_use]
pub struct VecConfig {
    num_threads: usize,
    autoreset: AutoresetMode,
    pin_threads: bool,
}

impl VecConfig {
    setters! {
        /// Sets the number of worker threads. The default, 0, starts one per core. There are never
        /// more threads than environments.
        with_num_threads(num_threads: usize),
        /// Sets when the next episode starts. The default, [`AutoresetMode::NextStep`], is
        /// Gymnasium's.
        with_autoreset(autoreset: AutoresetMode),
        /// Sets whether each worker thread keeps to its own core, the first thread to the first
        /// core. The default is false: pinning helps only if nothing else runs on the machine.
        with_pin_threads(pin_threads: bool),
    }

    getters! {
        /// The number of worker threads; 0 for one per core.
        num_threads: usize,
        /// When the next episode starts.
        autoreset: AutoresetMode,
        /// Whether each worker thread keeps to its own core.
        pin_threads: bool,
    }

    /// Returns the number of worker threads for `num_envs` environments.
    pub(crate) fn threads_for(&self, num_envs: usize) -> usize {
        let cores = || thread::available_parallelism().map_or(1, NonZeroUsize::get);
        NonZeroUsize::new(self.num_threads).map_or_else(cores, NonZeroUsize::get).min(num_envs)
    }
}

/// The reset of the environments of a [`VecEnv`](super::VecEnv).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct VecReset<'a, O> {
    /// The seeds of the environments.
    pub seeds: Seeds<'a>,
    /// Whether each environment is reset; without a mask all are.
    pub mask: Option<&'a [bool]>,
    /// Options of every reset.
    pub options: O,
}

impl<O: Default> VecReset<'_, O> {
    /// Creates a reset of all environments, the first with `seed`, the next with `seed + 1`, and so
    /// on.
    #[must_use]
    pub fn seeded(seed: u64) -> Self {
        Self { seeds: Seeds::From(seed), mask: None, options: O::default() }
    }
}

/// The seeds of the environments of a [`VecEnv`](super::VecEnv).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seeds<'a> {
    /// No seeds: the random numbers continue, as in [`Env::reset_with`](crate::Env::reset_with).
    #[default]
    Continue,
    /// Environment `i` gets this seed plus `i`.
    From(u64),
    /// One element for each environment; `None` continues its random numbers.
    Each(&'a [Option<u64>]),
}

impl From<Option<u64>> for Seeds<'_> {
    fn from(seed: Option<u64>) -> Self {
        seed.map_or(Self::Continue, Self::From)
    }
}

impl Seeds<'_> {
    pub(super) fn of(&self, env_id: usize) -> Option<u64> {
        match self {
            Self::Continue => None,
            Self::From(first) => Some(first + env_id as u64),
            Self::Each(seeds) => seeds[env_id],
        }
    }
}

impl<O> VecReset<'_, O> {
    pub(super) fn check(&self, num_envs: usize) -> Result<(), VecEnvError> {
        let each = if let Seeds::Each(seeds) = self.seeds { Some(seeds.len()) } else { None };
        for (what, len) in [("seeds", each), ("mask", self.mask.map(<[bool]>::len))] {
            if let Some(actual) = len.filter(|&len| len != num_envs) {
                return Err(VecEnvError::Count { what, actual, num_envs });
            }
        }
        if let Seeds::From(first) = self.seeds
            && first.checked_add(num_envs as u64 - 1).is_none()
        {
            return Err(VecEnvError::SeedTooLarge { first, num_envs });
        }
        if self.mask.is_some_and(|mask| !mask.contains(&true)) {
            return Err(VecEnvError::EmptyMask);
        }
        Ok(())
    }
}
