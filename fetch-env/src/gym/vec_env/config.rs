//! Settings of a vector of environments, and its resets.

use std::{num::NonZeroUsize, thread};

use serde::{Deserialize, Serialize};

use crate::gym::vec_env::error::VecEnvError;

/// The largest number of environments of a vector. On MuJoCo they take 82 GiB, 1.3 MiB each.
pub(super) const MAX_ENVS: usize = 1 << 16;

/// The largest number of worker threads of a vector. It is far above the number of cores, and far
/// below the number at which systems refuse threads or memory for them.
const MAX_THREADS: usize = 1024;

/// Checks the number of environments before memory is allocated for them.
pub(crate) const fn check_num_envs(num_envs: usize) -> Result<(), VecEnvError> {
    match num_envs {
        0 => Err(VecEnvError::NoEnvs),
        1..=MAX_ENVS => Ok(()),
        _ => Err(VecEnvError::TooManyEnvs { most: MAX_ENVS }),
    }
}

/// When the next episode starts after the end of one.
///
/// The modes are Gymnasium's. An environment that failed counts as one whose episode is over.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AutoresetMode {
    /// The next step resets the environment instead: it ignores its action, gives reward 0 and ends
    /// no episode.
    #[default]
    NextStep,
    /// The step that ends the episode also resets the environment: observation and info are the
    /// first of the next episode; [`VecStep::next_observation`](super::VecStep::next_observation)
    /// and [`VecStep::final_info`](super::VecStep::final_info) have the last ones of the old
    /// episode.
    SameStep,
    /// Never: the caller resets with a [mask](VecReset::mask). A step before that gives
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
    settings! {
        /// Sets the number of worker threads. The default, 0, starts one per core. There are never
        /// more threads than environments, and at most 1,024: a vector that would have more is
        /// [`VecEnvError::TooManyThreads`]. With one, [`VecEnv::step`](super::VecEnv::step) and
        /// [`VecEnv::reset`](super::VecEnv::reset) run on the caller's thread, and only what is
        /// sent runs on the worker.
        with_num_threads(num_threads: usize);
        /// Sets when the next episode starts. The default, [`AutoresetMode::NextStep`], is
        /// Gymnasium's.
        with_autoreset(autoreset: AutoresetMode);
        /// Sets whether each worker thread is pinned to its own core, the first thread to the first
        /// core. The default is false: pinning helps only if nothing else runs on the machine.
        with_pin_threads(pin_threads: bool);

        /// Returns the number of worker threads; 0 for one per core.
        num_threads: usize;
        /// Returns when the next episode starts.
        autoreset: AutoresetMode;
        /// Whether each worker thread is pinned to its own core.
        pin_threads: bool;
    }

    /// Returns the number of worker threads for `num_envs` environments.
    pub(crate) fn threads_for(&self, num_envs: usize) -> Result<usize, VecEnvError> {
        let cores = || thread::available_parallelism().map_or(1, NonZeroUsize::get);
        let wanted = NonZeroUsize::new(self.num_threads).map(NonZeroUsize::get);
        match wanted.unwrap_or_else(|| cores().min(MAX_THREADS)).min(num_envs) {
            threads @ ..=MAX_THREADS => Ok(threads),
            threads => Err(VecEnvError::TooManyThreads { threads, most: MAX_THREADS }),
        }
    }
}

/// A reset of the environments of a [`VecEnv`](super::VecEnv). Each list has one element for each
/// environment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VecReset<'a, O> {
    /// The seeds; without a list, and where a seed is `None`, the random numbers continue, as in
    /// [`Env::reset_with`](crate::Env::reset_with).
    pub seeds: Option<&'a [Option<u64>]>,
    /// Whether each environment is reset; without a mask all are.
    pub mask: Option<&'a [bool]>,
    /// Options of the resets; without a list, the default ones.
    pub options: Option<&'a [O]>,
}

impl<O> Default for VecReset<'_, O> {
    fn default() -> Self {
        Self { seeds: None, mask: None, options: None }
    }
}

impl<O> VecReset<'_, O> {
    pub(super) fn check(&self, num_envs: usize) -> Result<(), VecEnvError> {
        let seeds = self.seeds.map(<[_]>::len);
        let mask = self.mask.map(<[_]>::len);
        let options = self.options.map(<[_]>::len);
        for (what, len) in [("seeds", seeds), ("mask", mask), ("options", options)] {
            if let Some(actual) = len.filter(|&len| len != num_envs) {
                return Err(VecEnvError::Count { what, actual, num_envs });
            }
        }
        if self.mask.is_some_and(|mask| !mask.contains(&true)) {
            return Err(VecEnvError::EmptyMask);
        }
        Ok(())
    }
}
