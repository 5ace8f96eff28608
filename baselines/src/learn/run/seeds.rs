//! The seeds of a run: each use of random numbers has its own seeds, so that no two uses share any
//! numbers.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A use of random numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) enum SeedUse {
    /// The first weights, and the noise of updates.
    Algorithm,
    /// The episodes that are collected.
    Episodes,
    /// Random actions and noise while collecting.
    Exploration,
    /// Which still episodes are left out.
    MotionlessEpisodes,
    /// The batches of updates.
    Batches,
    /// The batches that normalizers take in.
    Normalizers,
    /// The seeds of processes.
    Ranks,
    /// The batches of demonstrations that normalizers take in.
    DemonstratedNormalizers,
    /// The noise of the observations of each update.
    ObservationNoise,
    /// The transitions that describe the buffer in a row of the curve.
    Diagnostics,
    /// The batches of an actor that sees pictures.
    #[cfg(feature = "render")]
    PixelBatches,
}

/// Returns the seed of a process's own random numbers: for the first process, that of the run.
pub(crate) fn seed_of_rank(seed: u64, rank: usize) -> u64 {
    if rank == 0 { seed } else { seed_for(seed, SeedUse::Ranks, rank as u64) }
}

/// Returns seed `number` of a use, of a run with `seed`. `number` is below 2^56.
pub(crate) fn seed_for(seed: u64, seed_use: SeedUse, number: u64) -> u64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((seed_use as u64) << 56 | number);
    rng.next_u64()
}
