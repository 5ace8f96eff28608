//! Processes that share a run: each has a rank, and they exchange what they compute.
//!
//! [`OneProcess`] is a run of one process. With the feature `mpi`, `MpiWorkers` are the processes
//! that `mpirun` or `srun` starts.
//!
#![doc = include_str!("../../MANY_MACHINES.md")]

mod agreement;
#[cfg(feature = "mpi")]
mod mpi;
mod values;
#[cfg(feature = "mpi")]
mod watch;

use std::fmt;
use std::ops::Range;

pub use self::agreement::{Disagreement, agree};
#[cfg(feature = "mpi")]
pub use self::mpi::{Awaited, Late, MpiError, MpiWorkers};
pub use self::values::{UnreadableMessage, gather_values, sum};

/// Processes that share a run.
///
/// All of them call the same methods in the same order; a call returns when all have made it.
/// Results of several processes are in the order of their ranks.
///
/// ```
/// use baselines::workers::{OneProcess, UnreadableMessage, Workers, share, sum};
///
/// /// Adds the squares below `count`, each process its share of them.
/// fn sum_of_squares(workers: &mut dyn Workers, count: usize) -> Result<u64, UnreadableMessage> {
///     let own = share(workers, count).map(|number| (number * number) as u64).sum();
///     sum(workers, own)
/// }
///
/// assert_eq!(sum_of_squares(&mut OneProcess, 4)?, 14);
/// # Ok::<(), UnreadableMessage>(())
/// ```
pub trait Workers: fmt::Debug + Send {
    /// Returns the number of this process, from 0 to [`size`](Self::size) - 1. The first one writes
    /// files.
    fn rank(&self) -> usize;

    /// Returns the number of processes.
    fn size(&self) -> usize;

    /// Replaces each number by its mean over all processes. All pass equally many numbers, and all
    /// get the same bits.
    fn average(&mut self, numbers: &mut [f32]);

    /// Sends the message `messages[rank]` to each process, and returns the messages that all
    /// processes sent to this one. There is one message for each process.
    fn exchange(&mut self, messages: Vec<Vec<u8>>) -> Vec<Vec<u8>>;

    /// Returns the time spent in these methods so far, waiting included, in seconds.
    fn seconds(&self) -> f64;

    /// Sends a message to all processes, and returns the messages of all.
    fn gather(&mut self, message: &[u8]) -> Vec<Vec<u8>> {
        self.exchange(vec![message.to_vec(); self.size()])
    }

    /// Sends a message to the first process. Returns the messages of all in the first process, and
    /// none in the others.
    fn gather_first(&mut self, message: Vec<u8>) -> Vec<Vec<u8>> {
        let mut messages = vec![Vec::new(); self.size()];
        messages[0] = message;
        let messages = self.exchange(messages);
        if self.rank() == 0 { messages } else { Vec::new() }
    }
}

/// A run without other processes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OneProcess;

impl Workers for OneProcess {
    fn rank(&self) -> usize {
        0
    }

    fn size(&self) -> usize {
        1
    }

    fn average(&mut self, _: &mut [f32]) {}

    fn exchange(&mut self, messages: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        messages
    }

    fn seconds(&self) -> f64 {
        0.0
    }
}

/// Returns this process's share of `count` things: consecutive ones, in the order of ranks.
#[must_use]
pub fn share(workers: &dyn Workers, count: usize) -> Range<usize> {
    share_of(workers.rank(), workers.size(), count)
}

/// Returns the share of `count` that falls to part `rank` of `size`.
pub(crate) fn share_of(rank: usize, size: usize, count: usize) -> Range<usize> {
    let bound = |rank: usize| (count as u128 * rank as u128 / size as u128) as usize;
    bound(rank)..bound(rank + 1)
}
