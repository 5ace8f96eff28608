//! Several goal strategies at once.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::GoalStrategy;
use crate::sample::draws::unit;

/// The most strategies that can be mixed.
const MAX_PARTS: usize = 6;

/// Goal strategies and how often each is used, on average, for the rows that get a new goal. The rows
/// that keep their own goal are the sampler's [`RelabelRatio`](crate::RelabelRatio).
///
/// Serialized as the list of its parts.
///
/// # Example
/// ```
/// use her_relabel::{GoalMixture, GoalPart, GoalStrategy, RelabelRatio, Sampler};
///
/// // Of the relabeled rows two in three get a future goal, one in three one that was once desired.
/// let goals = GoalMixture::new(&[
///     GoalPart { strategy: GoalStrategy::Future, weight: 2.0 },
///     GoalPart { strategy: GoalStrategy::PastDesired, weight: 1.0 },
/// ])?;
/// let sampler = Sampler::new(256, GoalStrategy::Future, RelabelRatio::from_k(4)).with_goals(goals);
/// # Ok::<(), her_relabel::MixtureError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<GoalPart>", into = "Vec<GoalPart>")]
pub struct GoalMixture {
    parts: [GoalPart; MAX_PARTS],
    len: usize,
    /// The sum of the weights.
    total: f64,
}

/// A strategy and its weight in a [`GoalMixture`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalPart {
    /// The strategy.
    pub strategy: GoalStrategy,
    /// How often it is used, in proportion to the other weights; finite and not negative.
    pub weight: f64,
}

impl GoalMixture {
    /// A mixture of one to six strategies.
    ///
    /// # Errors
    /// [`MixtureError`] if there are none or too many, a weight is negative or not finite, or the
    /// weights do not add up to a positive finite number.
    pub fn new(parts: &[GoalPart]) -> Result<Self, MixtureError> {
        if parts.is_empty() || parts.len() > MAX_PARTS {
            return Err(MixtureError::PartCount { count: parts.len() });
        }
        if let Some(part) = parts.iter().find(|part| !(0.0..f64::INFINITY).contains(&part.weight)) {
            return Err(MixtureError::BadWeight { weight: part.weight });
        }
        let total: f64 = parts.iter().map(|part| part.weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(MixtureError::BadTotal { total });
        }
        let mut mixture = Self { total, len: parts.len(), ..Self::only(GoalStrategy::Future) };
        mixture.parts[..parts.len()].copy_from_slice(parts);
        Ok(mixture)
    }

    /// One strategy, always.
    #[must_use]
    pub const fn only(strategy: GoalStrategy) -> Self {
        let unused = GoalPart { strategy: GoalStrategy::Future, weight: 0.0 };
        let mut parts = [unused; MAX_PARTS];
        parts[0] = GoalPart { strategy, weight: 1.0 };
        Self { parts, len: 1, total: 1.0 }
    }

    /// The strategies and their weights.
    #[must_use]
    pub fn parts(&self) -> &[GoalPart] {
        &self.parts[..self.len]
    }

    /// The strategy that a random word chooses.
    #[inline(always)]
    pub(crate) fn choose(&self, word: impl FnOnce() -> u64) -> GoalStrategy {
        if self.len == 1 {
            return self.parts[0].strategy;
        }
        self.choose_part(word())
    }

    #[inline(never)]
    fn choose_part(&self, word: u64) -> GoalStrategy {
        let mut rest = unit(word) * self.total;
        let mut chosen = self.parts[0].strategy;
        for part in self.parts().iter().filter(|part| part.weight > 0.0) {
            chosen = part.strategy;
            if rest < part.weight {
                break;
            }
            rest -= part.weight;
        }
        chosen
    }
}

impl TryFrom<Vec<GoalPart>> for GoalMixture {
    type Error = MixtureError;

    fn try_from(parts: Vec<GoalPart>) -> Result<Self, MixtureError> {
        Self::new(&parts)
    }
}

impl From<GoalMixture> for Vec<GoalPart> {
    fn from(mixture: GoalMixture) -> Self {
        mixture.parts().to_vec()
    }
}

/// Strategies and weights that make no mixture.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum MixtureError {
    /// There are no parts, or too many.
    #[error("a mixture has from 1 to {MAX_PARTS} parts, but {count} were given")]
    PartCount {
        /// How many there are.
        count: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("the weight {weight} is no share; use a finite number from 0")]
    BadWeight {
        /// The weight.
        weight: f64,
    },
    /// The weights add up to 0 or overflow.
    #[error("the weights add up to {total}; make at least one positive, and all of them moderate")]
    BadTotal {
        /// Their sum.
        total: f64,
    },
}
