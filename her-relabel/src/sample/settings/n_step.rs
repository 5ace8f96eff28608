//! Windows of several steps.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use crate::unit_interval::UnitInterval;

/// Settings of windows of several steps, for n-step returns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[must_use]
pub struct NStep {
    steps: NonZeroUsize,
    gamma: UnitInterval,
}

impl NStep {
    /// Creates windows of up to `steps` steps, shorter where the episode ends, with rewards
    /// discounted by `gamma` per step. A `gamma` of 0.98 is usual for episodes of 50 steps.
    pub const fn new(steps: NonZeroUsize, gamma: UnitInterval) -> Self {
        Self { steps, gamma }
    }

    settings! {
        /// Returns the maximal number of steps of a window.
        steps: NonZeroUsize;
        /// Returns the discount per step.
        gamma: UnitInterval;
    }

    /// Returns the discounted sum of the rewards of consecutive steps, at least one, and the
    /// discount of what follows them.
    #[inline(always)]
    pub fn sum(self, rewards: impl Iterator<Item = f64>) -> (f64, f64) {
        // -0.0 is the additive identity: a single reward keeps its bits.
        rewards.fold((-0.0, 1.0), |(sum, discount), reward| {
            (sum + discount * reward, discount * self.gamma.get())
        })
    }
}
