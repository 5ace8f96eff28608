//! Where hindsight goals come from, and how often.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Discount;
use crate::sample::draws::{below, unit};
use crate::store::episodes::{Episode, Episodes};

/// Where the goal comes from that replaces the desired goal of a relabeled transition.
///
/// The states of an episode of `T` transitions are `0..=T`, and transition `t` leads from state `t`
/// to state `t + 1`. All draws are independent of each other, and uniform but for
/// [`Geometric`](Self::Geometric). Of an episode whose oldest transitions have been overwritten, only
/// the goals achieved by what is left are drawn.
///
/// Source: Andrychowicz et al., *Hindsight Experience Replay*, 2017, section 4.5, for the first four.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum GoalStrategy {
    /// Achieved in a state from `t + 1` to `T`: the transition's own next state is among them.
    Future,
    /// Achieved in state `T`.
    Final,
    /// Achieved in a state from 1 to `T`.
    Episode,
    /// Achieved after any transition of the buffer.
    Random,
    /// Achieved in state `t + j`, with a probability proportional to `gamma^(j - 1)` for `j` from 1 to
    /// `T - t`: near goals are likelier. A `gamma` of 1 is [`Future`](Self::Future) in distribution,
    /// and 0 is always the next state.
    ///
    /// Source: Eysenbach et al., *Contrastive learning as goal-conditioned reinforcement learning*,
    /// 2022; the distribution is cut off at the end of the episode and normalized.
    Geometric {
        /// The discount of each further step.
        gamma: Discount,
    },
    /// The desired goal of the episode of any transition of the buffer.
    ///
    /// Source: Pitis et al., *Maximum entropy gain exploration for long horizon multi-goal
    /// reinforcement learning*, 2020, where it is called past.
    PastDesired,
}

/// A drawn goal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Goal {
    /// The transition that it was achieved by, or that pursued it.
    pub(crate) source: u64,
    /// The tape's row that holds it: as desired goal if it is an episode's own, else as achieved goal.
    pub(crate) row: u64,
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
                achieved_by(transition + gamma.steps_below(end - transition, unit(word)))
            }
            Self::Random | Self::PastDesired => self.draw_from_any(episodes, word),
        }
    }

    /// Draws a goal of any episode.
    #[inline(never)]
    fn draw_from_any(self, episodes: &Episodes, word: u64) -> Goal {
        let source = episodes.pick(word);
        let episode = episodes.of(source);
        let is_desired = self == Self::PastDesired;
        let row = if is_desired { episode.last_row() } else { episode.row(source) + 1 };
        Goal { source, row, is_desired }
    }
}

/// The share of sampled transitions that get a new goal, from 0 to 1.
///
/// Each row of a batch is drawn on its own, so the share holds on average for batches of any size.
///
/// # Example
/// ```
/// use her_relabel::RelabelRatio;
///
/// assert_eq!(RelabelRatio::from_k(4).get(), 0.8);
/// assert_eq!(RelabelRatio::new(0.5)?.get(), 0.5);
/// # Ok::<(), her_relabel::RatioError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd, Serialize, Deserialize)]
#[serde(try_from = "f64", into = "f64")]
pub struct RelabelRatio(f64);

impl RelabelRatio {
    /// No transition: plain experience replay.
    pub const NONE: Self = Self(0.0);
    /// Every transition.
    pub const ALL: Self = Self(1.0);

    /// The share `ratio`.
    ///
    /// # Errors
    /// [`RatioError`] if it is not between 0 and 1.
    pub fn new(ratio: f64) -> Result<Self, RatioError> {
        if (0.0..=1.0).contains(&ratio) { Ok(Self(ratio)) } else { Err(RatioError { ratio }) }
    }

    /// `k` relabeled transitions for each that is left alone: the share `k / (k + 1)`. This `k` is
    /// the paper's, and `n_sampled_goal` of other libraries.
    #[must_use]
    pub fn from_k(k: u32) -> Self {
        Self(f64::from(k) / (f64::from(k) + 1.0))
    }

    /// The share, from 0 to 1.
    #[inline]
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }
}

impl TryFrom<f64> for RelabelRatio {
    type Error = RatioError;

    fn try_from(ratio: f64) -> Result<Self, RatioError> {
        Self::new(ratio)
    }
}

impl From<RelabelRatio> for f64 {
    fn from(ratio: RelabelRatio) -> Self {
        ratio.0
    }
}

/// A number that is no share.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error(
    "a relabel ratio lies between 0 and 1, but it is {ratio}; for k goals use RelabelRatio::from_k"
)]
#[non_exhaustive]
pub struct RatioError {
    /// The number that was refused.
    pub ratio: f64,
}
