//! The reward trait that environments and replay buffers use.

use std::ops::RangeInclusive;
use std::rc::Rc;
use std::sync::Arc;

use crate::error::GoalError;
use crate::pairs::{GoalPairs, check_goals};

/// The reward of a goal-conditioned task: a pure function of the achieved and the desired goal.
///
/// *Pure* is the contract: equal arguments give equal bits, at any time and on any thread.
/// Hindsight relabeling depends on it. The arguments are always in the order `achieved_goal`,
/// `desired_goal`.
///
/// Only [`reward`](Self::reward) and [`is_success`](Self::is_success) are required. The batched
/// forms call them row by row; override one if a whole batch can be computed faster, with results
/// that are the same bit for bit. The trait is object safe, and a reference, [`Box`], [`Rc`] or
/// [`Arc`] of a reward is a reward.
///
/// Methods without `try_` do not check the goals: they must neither panic nor count a goal that is
/// NaN, infinite or of the wrong length as a success.
///
/// # Example
/// ```
/// use goal_reward::GoalReward;
///
/// /// Bit flipping: every bit must be as desired.
/// struct AllBits;
///
/// impl GoalReward for AllBits {
///     fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
///         if self.is_success(achieved_goal, desired_goal) { 0.0 } else { -1.0 }
///     }
///     fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
///         achieved_goal == desired_goal
///     }
/// }
/// assert_eq!(AllBits.try_reward(&[1.0, 0.0], &[1.0, 1.0])?, -1.0);
/// # Ok::<(), goal_reward::GoalError>(())
/// ```
pub trait GoalReward {
    /// Returns the reward for achieving `achieved_goal` when the goal is `desired_goal`.
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64;

    /// Returns whether `achieved_goal` counts as reaching `desired_goal`.
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool;

    /// Returns the range in which the reward of every pair of finite goals lies, for learners that
    /// keep their estimates of returns within the possible range. Unbounded by default, which is
    /// always right; a narrower range speeds up learning.
    ///
    /// ```
    /// use goal_reward::{DistanceReward, GoalReward};
    ///
    /// assert_eq!(DistanceReward::sparse().bounds(), -1.0..=0.0);
    /// assert_eq!(DistanceReward::dense().bounds(), f64::NEG_INFINITY..=0.0);
    /// ```
    fn bounds(&self) -> RangeInclusive<f64> {
        f64::NEG_INFINITY..=f64::INFINITY
    }

    /// Returns whether the task ends here, so that no rewards follow. Never by default, as in every
    /// Fetch task, where the agent must hold a reached goal.
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let _ = (achieved_goal, desired_goal);
        false
    }

    /// Returns whether the episode is cut off here for a reason outside the task. Never by default;
    /// a time limit does not depend on the goals and is counted elsewhere.
    fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let _ = (achieved_goal, desired_goal);
        false
    }

    /// Writes the [`reward`](Self::reward) of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.reward(achieved, desired))
    }

    /// Writes [`is_success`](Self::is_success) of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.is_success(achieved, desired))
    }

    /// Writes [`terminated`](Self::terminated) of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn terminated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.terminated(achieved, desired))
    }

    /// Writes [`truncated`](Self::truncated) of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn truncated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.truncated(achieved, desired))
    }

    /// Checks the goals and returns their [`reward`](Self::reward).
    ///
    /// # Errors
    /// [`GoalError`] if the goals are empty, differ in length or are not finite.
    fn try_reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> Result<f64, GoalError> {
        check_goals(achieved_goal, desired_goal)?;
        Ok(self.reward(achieved_goal, desired_goal))
    }

    /// Checks the goals and writes [`reward`](Self::reward) of every pair to `out`.
    ///
    /// # Errors
    /// [`GoalError::NotFinite`] or [`GoalError::OutputLength`]; `out` is then left unchanged.
    fn try_reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        pairs.check_output(out.len())?;
        pairs.check_finite()?;
        self.reward_batch(pairs, out)
    }
}

/// Forwards every method that a reward may override to the value behind a pointer.
macro_rules! forward {
    (each: $($one:ident -> $result:ty),*; batch: $($batch:ident: $element:ty),*) => {
        $(fn $one(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> $result {
            (**self).$one(achieved_goal, desired_goal)
        })*
        $(fn $batch(&self, pairs: GoalPairs<'_>, out: &mut [$element]) -> Result<(), GoalError> {
            (**self).$batch(pairs, out)
        })*
    };
}

macro_rules! reward_through_pointer {
    ($($pointer:ty),*) => {$(
        impl<R: GoalReward + ?Sized> GoalReward for $pointer {
            fn bounds(&self) -> RangeInclusive<f64> {
                (**self).bounds()
            }
            forward! {
                each: reward -> f64, is_success -> bool, terminated -> bool, truncated -> bool;
                batch: reward_batch: f64, is_success_batch: bool, terminated_batch: bool,
                truncated_batch: bool
            }
        }
    )*};
}

reward_through_pointer!(&R, Box<R>, Rc<R>, Arc<R>);
