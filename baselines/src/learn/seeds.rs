//! The seeds of a run: each use of random numbers has its own seeds, so that no two uses share any
//! numbers.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

/// A use of random numbers.
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

/// Returns the seed of a process's own random numbers: for the first process, that of the run.
pub(super) fn seed_of_rank(seed: u64, rank: usize) -> u64 {
    if rank == 0 { seed } else { seed_for(seed, Purpose::Ranks, rank as u64) }
}

/// Returns seed `number` for a purpose, of a run with `seed`. `number` is below 2^56.
pub(super) fn seed_for(seed: u64, purpose: Purpose, number: u64) -> u64 {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream((purpose as u64) << 56 | number);
    rng.next_u64()
}

/// The seeds of the resets that a wrapper draws for itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ResetSeeds {
    /// The seed of the last reset that had one.
    seed: u64,
    /// The number of resets since.
    resets: u64,
}

impl ResetSeeds {
    /// Returns the state after a reset with a seed, or without one.
    pub(crate) const fn after(self, seed: Option<u64>) -> Self {
        match seed {
            Some(seed) => Self { seed, resets: 0 },
            None => Self { resets: self.resets + 1, ..self },
        }
    }

    /// Returns the random numbers of the last reset.
    pub(crate) fn rng(self) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.resets);
        rng
    }
}
