//! The strategies that choose hindsight goals, and mixtures of them.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::sample::random::{below, geometric, uniform};
use crate::split_mix::unit;
use crate::store::episodes::{Episode, Episodes};
use crate::unit_interval::UnitInterval;

/// The most strategies that can be mixed.
const MAX_PARTS: usize = 6;

/// The strategy that chooses the new goal of a relabeled transition.
///
/// The states of an episode of `T` transitions are `0..=T`, and transition `t` leads from state `t`
/// to state `t + 1`. All draws are independent, and uniform except with
/// [`Geometric`](Self::Geometric). If the oldest transitions of an episode have been overwritten,
/// only goals achieved by the remaining ones are drawn.
///
/// Source: Andrychowicz et al., *Hindsight Experience Replay*, 2017, section 4.5, for the first
/// four.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
#[non_exhaustive]
pub enum GoalStrategy {
    /// A goal achieved in a state from `t + 1` to `T`, which includes the transition's own next
    /// state.
    Future,
    /// The goal achieved in state `T`.
    Final,
    /// A goal achieved in a state from 1 to `T`.
    Episode,
    /// A goal achieved after any transition of the buffer.
    Random,
    /// A goal achieved in state `t + j`, with a probability proportional to `gamma^(j - 1)` for `j`
    /// from 1 to `T - t`, so that near goals are more likely. A `gamma` of 1 has the distribution
    /// of [`Future`](Self::Future), and 0 always gives the next state.
    ///
    /// Source: Eysenbach et al., *Contrastive learning as goal-conditioned reinforcement learning*,
    /// 2022. The distribution is truncated at the end of the episode and normalized.
    Geometric {
        /// The discount of each further step.
        gamma: UnitInterval,
    },
    /// The desired goal of the episode of any transition of the buffer.
    ///
    /// Source: Pitis et al., *Maximum entropy gain exploration for long horizon multi-goal
    /// reinforcement learning*, 2020, which calls it past.
    PastDesired,
}

/// A drawn goal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal {
    /// The transition that achieved or pursued it.
    pub(crate) source: u64,
    /// The tape's row that holds it.
    pub(crate) row: u64,
    /// Whether it is that row's desired goal, not the achieved one.
    pub(crate) is_desired: bool,
}

impl GoalStrategy {
    /// Draws the goal of `transition` of `episode`.
    #[inline(always)]
    pub(crate) fn draw(
        self,
        transition: u64,
        episode: &Episode,
        episodes: &Episodes,
        word: u64,
    ) -> Goal {
        let &Episode { start, end, .. } = episode;
        let achieved_by = |source| Goal { source, row: episode.row(source) + 1, is_desired: false };
        match self {
            Self::Future => achieved_by(transition + below(word, end - transition)),
            Self::Final => achieved_by(end - 1),
            Self::Episode => achieved_by(start + below(word, end - start)),
            Self::Geometric { gamma } => {
                achieved_by(transition + geometric(gamma, end - transition, unit(word)))
            }
            Self::Random | Self::PastDesired => self.draw_from_any(episodes, word),
        }
    }

    /// Draws a goal from any episode.
    #[inline(never)]
    fn draw_from_any(self, episodes: &Episodes, word: u64) -> Goal {
        let source = uniform(episodes, word);
        let episode = episodes.of(source);
        let is_desired = self == Self::PastDesired;
        let row = if is_desired { episode.last_row() } else { episode.row(source) + 1 };
        Goal { source, row, is_desired }
    }
}

/// Goal strategies, and the average share of each among the rows that get a new goal. The share of
/// rows that get one is the sampler's [ratio](crate::Sampler::with_ratio).
///
/// Serialized as the list of its parts, which is checked when it is read.
///
/// # Example
/// ```
/// use her_relabel::{GoalMixture, GoalPart, GoalStrategy, Sampler, UnitInterval};
///
/// // Two in three relabeled rows get a future goal, and one in three a goal that was once desired.
/// let goals = GoalMixture::new(&[
///     GoalPart::new(GoalStrategy::Future, 2.0),
///     GoalPart::new(GoalStrategy::PastDesired, 1.0),
/// ])?;
/// let ratio = UnitInterval::from_k(4);
/// let sampler = Sampler::new(256, GoalStrategy::Future, ratio).with_goals(goals);
/// # Ok::<(), her_relabel::MixtureError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<GoalPart>", into = "Vec<GoalPart>")]
#[must_use]
pub struct GoalMixture {
    parts: [GoalPart; MAX_PARTS],
    len: usize,
    /// The sum of the weights.
    total: f64,
}

/// A strategy and its weight in a [`GoalMixture`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
#[must_use]
pub struct GoalPart {
    strategy: GoalStrategy,
    weight: f64,
}

impl GoalPart {
    /// Creates a strategy that is used in proportion to its `weight`, finite and at least 0.
    pub const fn new(strategy: GoalStrategy, weight: f64) -> Self {
        Self { strategy, weight }
    }

    settings! {
        /// Returns the strategy.
        strategy: GoalStrategy;
        /// Returns the weight.
        weight: f64;
    }
}

impl GoalMixture {
    /// Checks a mixture of one to six strategies.
    ///
    /// # Errors
    /// [`MixtureError`] if there are none or too many, a weight is negative or not finite, or the
    /// sum of the weights is not a positive, finite number.
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

    /// Creates a mixture of one strategy.
    pub const fn only(strategy: GoalStrategy) -> Self {
        let unused = GoalPart::new(GoalStrategy::Future, 0.0);
        let mut parts = [unused; MAX_PARTS];
        parts[0] = GoalPart::new(strategy, 1.0);
        Self { parts, len: 1, total: 1.0 }
    }

    /// Returns the strategies and their weights.
    pub fn parts(&self) -> &[GoalPart] {
        &self.parts[..self.len]
    }

    /// Returns the strategy that a random word chooses.
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

/// Error returned for an invalid mixture.
#[derive(Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum MixtureError {
    /// There are no parts, or too many.
    #[error("a mixture cannot have {count} parts: pass 1 to {MAX_PARTS}")]
    PartCount {
        /// The number of parts.
        count: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("the weight {weight} is negative or not finite: use a finite number, at least 0")]
    BadWeight {
        /// The weight.
        weight: f64,
    },
    /// The weights add up to 0 or overflow.
    #[error("the weights add up to {total}: make at least one positive, and none enormous")]
    BadTotal {
        /// Their sum.
        total: f64,
    },
}
debug_as_display!(MixtureError);

#[cfg(test)]
mod tests {
    use super::*;

    fn mixture(weights: &[f64]) -> GoalMixture {
        let strategies = [
            GoalStrategy::Future,
            GoalStrategy::Final,
            GoalStrategy::Episode,
            GoalStrategy::Random,
        ];
        let parts: Vec<_> =
            strategies.iter().zip(weights).map(|(s, weight)| GoalPart::new(*s, *weight)).collect();
        GoalMixture::new(&parts).expect("weights")
    }

    #[test]
    fn each_part_has_its_share_of_the_words() {
        let mixture = mixture(&[1.0, 1.0, 2.0]);
        for (quarter, strategy) in [
            (0, GoalStrategy::Future),
            (1, GoalStrategy::Final),
            (2, GoalStrategy::Episode),
            (3, GoalStrategy::Episode),
        ] {
            let first: u64 = quarter << 62;
            assert_eq!(mixture.choose(|| first), strategy);
            assert_eq!(mixture.choose(|| first | u64::MAX >> 2), strategy);
        }
    }

    #[test]
    fn rounding_never_chooses_a_weight_of_zero() {
        // The rest of the largest word is not below the third weight.
        let mixture = mixture(&[1.2, 3.1, 6.5, 0.0]);
        assert_eq!(mixture.choose(|| u64::MAX), GoalStrategy::Episode);
    }
}
