use fetch_env::FetchObservation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::{Action, Policy};

/// Draws every action uniformly from the action space, [-1, 1] in each of four dimensions.
///
/// The generator is ChaCha, that of the environments' resets is PCG: equal seeds are safe. Drawing
/// actions from the very stream that drew the goal, as the same seed does in Python, makes actions
/// and goal correlate, and the mean return of Reach one unit too high.
#[derive(Clone, Debug)]
pub struct RandomPolicy {
    generator: ChaCha8Rng,
}

impl RandomPolicy {
    /// A policy whose actions are decided by `seed`.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { generator: ChaCha8Rng::seed_from_u64(seed) }
    }
}

impl Policy for RandomPolicy {
    fn act(&mut self, _observation: &FetchObservation) -> Action {
        std::array::from_fn(|_| self.generator.random_range(-1.0..=1.0))
    }
}
