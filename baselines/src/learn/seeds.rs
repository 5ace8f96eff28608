//! The seeds of a run: each use of random numbers has its own seeds, so that no two uses share any
//! numbers.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// What random numbers are for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Purpose {
    /// The first weights, and the noise of updates.
    Algorithm,
    /// The episodes that are collected.
    Episodes,
    /// Random actions and noise while collecting.
    Exploration,
    /// Which still episodes are left out.
    StillEpisodes,
    /// The batches of updates.
    Batches,
    /// The batches that normalizers take in.
    Normalizers,
    /// The seeds of processes.
    Ranks,
    /// The batches of demonstrations that normalizers take in.
    DemonstratedNormalizers,
}

/// Returns the seed of what a process does by itself: that of the run for the first one.
pub(super) fn seed_of_rank(seed: u64, rank: usize) -> u64 {
    if rank == 0 { seed } else { seed_for(seed, Purpose::Ranks, rank as u64) }
}

/// Returns seed `number` for a purpose, of a run with `seed`. `number` is below 2^56.
pub(super) fn seed_for(seed: u64, purpose: Purpose, number: u64) -> u64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((purpose as u64) << 56 | number);
    rng.next_u64()
}
