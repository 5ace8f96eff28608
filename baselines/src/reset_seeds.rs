//! The seeds of the resets that a wrapper draws for itself.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::{Deserialize, Serialize};

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
