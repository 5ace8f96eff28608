//! Windows of several steps, and discounts.

use std::num::NonZeroUsize;

use serde::{Deserialize, Serialize};

use crate::unit_interval::UnitInterval;

/// Settings of windows of several steps, for n-step returns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct NStep {
    steps: NonZeroUsize,
    gamma: UnitInterval,
}

impl NStep {
    /// Windows of up to `steps` steps, shorter where the episode ends, whose rewards are discounted by
    /// `gamma` per step. A `gamma` of 0.98 is usual for episodes of 50 steps.
    #[must_use]
    pub const fn new(steps: NonZeroUsize, gamma: UnitInterval) -> Self {
        Self { steps, gamma }
    }

    /// Returns the maximal number of steps of a window.
    #[inline]
    #[must_use]
    pub const fn steps(self) -> NonZeroUsize {
        self.steps
    }

    /// Returns the discount per step.
    #[inline]
    #[must_use]
    pub const fn gamma(self) -> UnitInterval {
        self.gamma
    }

    /// The discounted sum of the rewards of consecutive steps, at least one, and the discount of what
    /// follows them.
    #[inline(always)]
    pub(crate) fn sum(self, rewards: impl Iterator<Item = f64>) -> (f64, f64) {
        // -0.0 is the neutral element of addition: a single reward keeps its bits.
        rewards.fold((-0.0, 1.0), |(sum, discount), reward| {
            (sum + discount * reward, discount * self.gamma.get())
        })
    }
}

/// A number of steps from 0 to `n - 1`, each with a probability proportional to `gamma^steps`, from
/// a number `unit` of `[0, 1)`; `n` is at least 1.
#[inline(never)]
pub(crate) fn geometric(gamma: UnitInterval, n: u64, unit: f64) -> u64 {
    let gamma = gamma.get();
    if gamma == 1.0 {
        return ((unit * n as f64) as u64).min(n - 1);
    }
    // The inverse of the distribution function (1 - gamma^(s + 1)) / (1 - gamma^n). Gamma 0 needs no
    // special case: ln(1 - unit) is at least -37, and ln(0) is minus infinity.
    let tail = gamma.powf(n as f64);
    let steps = (unit * (tail - 1.0)).ln_1p() / gamma.ln();
    (steps as u64).min(n - 1)
}
