//! How much less a reward is worth a step later.

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// A discount per step, from 0 to 1.
///
/// # Example
/// ```
/// use her_relabel::Discount;
///
/// assert_eq!(Discount::new(0.98)?.get(), 0.98);
/// assert!(Discount::new(1.1).is_err());
/// # Ok::<(), her_relabel::DiscountError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct Discount(f64);

impl Discount {
    /// The discount `gamma`.
    ///
    /// # Errors
    /// [`DiscountError`] if it is not between 0 and 1.
    pub fn new(gamma: f64) -> Result<Self, DiscountError> {
        if (0.0..=1.0).contains(&gamma) { Ok(Self(gamma)) } else { Err(DiscountError { gamma }) }
    }

    /// The discount, from 0 to 1.
    #[inline]
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// The discounted sum of the rewards of consecutive steps, at least one, and the discount of what
    /// follows them.
    #[inline(always)]
    pub(crate) fn sum(self, rewards: impl Iterator<Item = f64>) -> (f64, f64) {
        // -0.0 is the zero of addition: a single reward keeps its bits.
        rewards.fold((-0.0, 1.0), |(sum, discount), reward| {
            (sum + discount * reward, discount * self.0)
        })
    }

    /// A number of steps from 0 to `n - 1`, each with a probability proportional to `gamma^steps`, from
    /// a number `unit` of `[0, 1)`; `n` is at least 1.
    #[inline(never)]
    pub(crate) fn steps_below(self, n: u64, unit: f64) -> u64 {
        let gamma = self.0;
        if gamma == 1.0 {
            return ((unit * n as f64) as u64).min(n - 1);
        }
        // The inverse of the distribution function (1 - gamma^(s + 1)) / (1 - gamma^n). With gamma 0
        // both logarithms are right: ln(1 - unit) is at least -37, and ln(0) is minus infinity.
        let tail = gamma.powf(n as f64);
        let steps = (unit * (tail - 1.0)).ln_1p() / gamma.ln();
        (steps as u64).min(n - 1)
    }
}

impl TryFrom<f64> for Discount {
    type Error = DiscountError;

    fn try_from(gamma: f64) -> Result<Self, DiscountError> {
        Self::new(gamma)
    }
}

impl From<Discount> for f64 {
    fn from(discount: Discount) -> Self {
        discount.0
    }
}

/// A number that is no discount.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "a discount lies between 0 and 1, but it is {gamma}; 0.98 is usual for episodes of 50 steps"
)]
#[non_exhaustive]
pub struct DiscountError {
    /// The number that was refused.
    pub gamma: f64,
}
