//! What a policy is, and the two simplest.

use fetch_env::FetchObservation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// An action of the Fetch tasks: x, y and z displacement of the gripper, and the fingers, each in
/// [-1, 1].
pub type Action = [f32; 4];

/// A policy: it chooses an action for each observation.
pub trait Policy {
    /// Forgets the last episode.
    fn reset(&mut self) {}

    /// Returns the action for an observation, in [-1, 1].
    fn act(&mut self, observation: &FetchObservation) -> Action;
}

impl<P: Policy + ?Sized> Policy for Box<P> {
    fn reset(&mut self) {
        (**self).reset();
    }

    fn act(&mut self, observation: &FetchObservation) -> Action {
        (**self).act(observation)
    }
}

/// Draws every action uniformly from the action space, [-1, 1] in each of four dimensions.
///
/// Actions come from ChaCha and the environments' resets from PCG, so that both may have the same
/// seed. In Python the same seed draws actions from the very stream that drew the goal: action and
/// goal then correlate, and the mean return of Reach is one unit too high.
#[derive(Clone, Debug)]
pub struct RandomPolicy {
    generator: ChaCha8Rng,
}

impl RandomPolicy {
    /// Returns a policy whose actions `seed` decides.
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

/// Does nothing: every action is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct ZeroPolicy;

impl Policy for ZeroPolicy {
    fn act(&mut self, _observation: &FetchObservation) -> Action {
        [0.0; 4]
    }
}
