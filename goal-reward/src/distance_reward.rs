//! The reward of the Fetch tasks: a function of the distance between the goals.

use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::distance::{distance_3d, goal_distance};
use crate::error::GoalError;
use crate::pairs::GoalPairs;
use crate::reward::GoalReward;
use crate::threshold::DistanceThreshold;

/// Whether the reward is the distance to the goal, or only shows whether the goal is reached.
///
/// Displayed and parsed as `sparse` and `dense`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum RewardKind {
    /// `-1` beyond the threshold and `-0.0` within it.
    Sparse,
    /// The negative distance.
    Dense,
}

impl fmt::Display for RewardKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Sparse => "sparse",
            Self::Dense => "dense",
        })
    }
}

impl FromStr for RewardKind {
    type Err = ParseRewardKindError;

    fn from_str(name: &str) -> Result<Self, ParseRewardKindError> {
        match name {
            "sparse" => Ok(Self::Sparse),
            "dense" => Ok(Self::Dense),
            _ => Err(ParseRewardKindError { name: name.to_owned() }),
        }
    }
}

/// Error returned for a name that is not a [`RewardKind`].
#[derive(Clone, PartialEq, Eq, Error)]
#[error("`{name}` is not a kind of reward: write `sparse` or `dense`")]
#[non_exhaustive]
pub struct ParseRewardKindError {
    /// The rejected name.
    pub name: String,
}
debug_as_display!(ParseRewardKindError);

/// The reward of the Fetch tasks, for goals of any dimension, with `d` their
/// [distance](goal_distance) and `t` the threshold:
///
/// - sparse: `-1.0` if `d > t`, else `-0.0` (NaN: `-1.0`);
/// - dense: `-d`;
/// - success: `d < t`;
/// - bounds: `-1.0..=0.0` if sparse, at most `0.0` if dense;
/// - terminated and truncated: never.
///
/// The batched forms give the same bits as the single ones; three-dimensional goals are fast.
///
/// Source: `compute_reward` and `_is_success` of gymnasium-robotics 1.4.2, whose comparisons also
/// disagree at `d == t`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct DistanceReward {
    kind: RewardKind,
    threshold: DistanceThreshold,
}

impl DistanceReward {
    /// Creates a reward of a kind; the threshold decides success in both kinds.
    #[must_use]
    pub const fn new(kind: RewardKind, threshold: DistanceThreshold) -> Self {
        Self { kind, threshold }
    }

    /// Returns the sparse reward with [`DistanceThreshold::FETCH`].
    #[must_use]
    pub const fn sparse() -> Self {
        Self::new(RewardKind::Sparse, DistanceThreshold::FETCH)
    }

    /// Returns the dense reward with [`DistanceThreshold::FETCH`].
    #[must_use]
    pub const fn dense() -> Self {
        Self::new(RewardKind::Dense, DistanceThreshold::FETCH)
    }

    /// Returns the kind of reward.
    #[must_use]
    pub const fn kind(&self) -> RewardKind {
        self.kind
    }

    /// Returns the distance below which a goal counts as reached.
    #[must_use]
    pub const fn threshold(&self) -> DistanceThreshold {
        self.threshold
    }

    #[inline(always)]
    fn sparse_of(&self, distance: f64) -> f64 {
        // `<=`, not `>`, so that NaN counts as a failure.
        if distance <= self.threshold.get() { -0.0 } else { -1.0 }
    }
}

impl GoalReward for DistanceReward {
    #[inline]
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let distance = goal_distance(achieved_goal, desired_goal);
        match self.kind {
            RewardKind::Sparse => self.sparse_of(distance),
            RewardKind::Dense => -distance,
        }
    }

    #[inline]
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        goal_distance(achieved_goal, desired_goal) < self.threshold.get()
    }

    fn bounds(&self) -> RangeInclusive<f64> {
        match self.kind {
            RewardKind::Sparse => -1.0..=0.0,
            RewardKind::Dense => f64::NEG_INFINITY..=0.0,
        }
    }

    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        match self.kind {
            RewardKind::Sparse => map_distance(pairs, out, |d| self.sparse_of(d)),
            RewardKind::Dense => map_distance(pairs, out, |d| -d),
        }
    }

    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        let threshold = self.threshold.get();
        map_distance(pairs, out, |d| d < threshold)
    }
}

/// Writes `f` of every pair's distance. The loop for three dimensions has no branch, so the
/// compiler vectorizes it.
#[inline(always)]
fn map_distance<T>(
    pairs: GoalPairs<'_>,
    out: &mut [T],
    f: impl Fn(f64) -> T,
) -> Result<(), GoalError> {
    if pairs.dim() != 3 {
        return pairs.map_into(out, |achieved, desired| f(goal_distance(achieved, desired)));
    }
    pairs.check_output(out.len())?;
    let achieved = pairs.achieved().as_chunks::<3>().0;
    let desired = pairs.desired().as_chunks::<3>().0;
    for ((slot, achieved), desired) in out.iter_mut().zip(achieved).zip(desired) {
        *slot = f(distance_3d(achieved, desired));
    }
    Ok(())
}
