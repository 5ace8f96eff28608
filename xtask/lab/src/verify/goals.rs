//! Goals that the environment never set, and the reward worked out by hand.

use goal_reward::{DistanceReward, RewardKind};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Draws goals uniformly from the chapter's workspace, and a margin around it.
pub struct GoalSampler {
    generator: ChaCha8Rng,
}

impl GoalSampler {
    pub fn new(seed: u64) -> Self {
        // Not the stream of the random policy, which has the plain seed.
        let mut generator = ChaCha8Rng::seed_from_u64(seed);
        generator.set_stream(1);
        Self { generator }
    }

    pub fn sample(&mut self) -> [f64; 3] {
        [(1.0, 1.6), (0.4, 1.1), (0.3, 0.9)]
            .map(|(low, high)| self.generator.random_range(low..high))
    }

    /// A goal within `radius` meters of a point along each axis.
    pub fn sample_near(&mut self, point: &[f64], radius: f64) -> [f64; 3] {
        std::array::from_fn(|axis| point[axis] + self.generator.random_range(-radius..radius))
    }
}

/// The reward by the chapter's formula, written out here to be independent of goal-reward.
pub fn expected_reward(reward: &DistanceReward, achieved: &[f64], desired: &[f64]) -> f64 {
    let squares: f64 = achieved.iter().zip(desired).map(|(a, d)| (a - d) * (a - d)).sum();
    let distance = squares.sqrt();
    match reward.kind() {
        RewardKind::Dense => -distance,
        RewardKind::Sparse if distance <= reward.threshold().get() => 0.0,
        RewardKind::Sparse => -1.0,
    }
}
