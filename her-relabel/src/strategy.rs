//! Where hindsight goals come from, and how often.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::draws::below;
use crate::episodes::Episode;

/// Which later achieved goal replaces the desired goal of a relabelled transition.
///
/// The states of an episode of `T` transitions are `0..=T`, and transition `t` leads from state `t`
/// to state `t + 1`. All draws are uniform and independent of each other. Of an episode whose oldest
/// transitions have been overwritten, only the goals achieved by what is left are drawn.
///
/// Source: Andrychowicz et al., *Hindsight Experience Replay*, 2017, section 4.5.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[non_exhaustive]
pub enum GoalStrategy {
    /// A state from `t + 1` to `T`: the transition's own next state is among them.
    Future,
    /// State `T`.
    Final,
    /// A state from 1 to `T`.
    Episode,
}

impl GoalStrategy {
    /// The transition whose next achieved goal becomes the goal of `transition` of `episode`.
    #[inline(always)]
    pub(crate) fn source(self, transition: u64, episode: &Episode, word: u64) -> u64 {
        let live = &episode.live;
        match self {
            Self::Future => transition + below(word, live.end - transition),
            Self::Final => live.end - 1,
            Self::Episode => live.start + below(word, live.end - live.start),
        }
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

    /// `k` relabelled transitions for each that is left alone: the share `k / (k + 1)`. This `k` is
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
