//! The trait that environments and replay buffers know a reward by.

use std::rc::Rc;
use std::sync::Arc;

use crate::{GoalError, GoalPairs, check_goals};

/// The reward of a goal-conditioned task: a pure function of the achieved and the desired goal.
///
/// *Pure* is the contract: equal arguments give equal bits, now and later, on any thread. Hindsight
/// relabeling depends on it. The arguments always come in the order `achieved_goal`,
/// `desired_goal`.
///
/// Only [`reward`](Self::reward) and [`is_success`](Self::is_success) must be written. The batched
/// forms call them row by row; override a batched form where a whole batch can be had faster, with
/// results that are the same bit for bit. The trait is object safe, and references, [`Box`], [`Rc`]
/// and [`Arc`] of a reward are rewards.
///
/// Calls without `try_` do not look for bad goals: they must neither panic nor call a goal that is
/// NaN, infinite or of the wrong length a success.
pub trait GoalReward {
    /// The reward for having achieved `achieved_goal` when `desired_goal` was asked for.
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64;

    /// Whether `achieved_goal` counts as having reached `desired_goal`.
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool;

    /// Whether the task ends here for good, so that no later reward exists. Never by default, as in
    /// every Fetch task: there a reached goal must be held.
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let _ = (achieved_goal, desired_goal);
        false
    }

    /// Whether the episode is cut off here for a reason outside the task. Never by default; a time
    /// limit is no function of the goals and is counted elsewhere.
    fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        let _ = (achieved_goal, desired_goal);
        false
    }

    /// [`reward`](Self::reward) of every pair, written to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.reward(achieved, desired))
    }

    /// [`is_success`](Self::is_success) of every pair, written to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.is_success(achieved, desired))
    }

    /// [`terminated`](Self::terminated) of every pair, written to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn terminated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.terminated(achieved, desired))
    }

    /// [`truncated`](Self::truncated) of every pair, written to `out`.
    ///
    /// # Errors
    /// [`GoalError::OutputLength`] if `out` does not hold one element per pair.
    fn truncated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |achieved, desired| self.truncated(achieved, desired))
    }

    /// [`reward`](Self::reward), after [`check_goals`].
    ///
    /// # Errors
    /// What [`check_goals`] finds.
    fn try_reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> Result<f64, GoalError> {
        check_goals(achieved_goal, desired_goal)?;
        Ok(self.reward(achieved_goal, desired_goal))
    }

    /// [`is_success`](Self::is_success), after [`check_goals`].
    ///
    /// # Errors
    /// What [`check_goals`] finds.
    fn try_is_success(
        &self,
        achieved_goal: &[f64],
        desired_goal: &[f64],
    ) -> Result<bool, GoalError> {
        check_goals(achieved_goal, desired_goal)?;
        Ok(self.is_success(achieved_goal, desired_goal))
    }

    /// [`reward_batch`](Self::reward_batch), after [`GoalPairs::check_finite`].
    ///
    /// # Errors
    /// [`GoalError::NotFinite`] or [`GoalError::OutputLength`]; `out` is left as it was then.
    fn try_reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        pairs.check_output(out.len())?;
        pairs.check_finite()?;
        self.reward_batch(pairs, out)
    }
}

/// Passes every method that a reward may override on to what the pointer holds.
macro_rules! reward_through_pointer {
    ($($pointer:ty),*) => {$(
        impl<R: GoalReward + ?Sized> GoalReward for $pointer {
            fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
                (**self).reward(achieved_goal, desired_goal)
            }
            fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
                (**self).is_success(achieved_goal, desired_goal)
            }
            fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
                (**self).terminated(achieved_goal, desired_goal)
            }
            fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
                (**self).truncated(achieved_goal, desired_goal)
            }
            fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
                (**self).reward_batch(pairs, out)
            }
            fn is_success_batch(
                &self,
                pairs: GoalPairs<'_>,
                out: &mut [bool],
            ) -> Result<(), GoalError> {
                (**self).is_success_batch(pairs, out)
            }
            fn terminated_batch(
                &self,
                pairs: GoalPairs<'_>,
                out: &mut [bool],
            ) -> Result<(), GoalError> {
                (**self).terminated_batch(pairs, out)
            }
            fn truncated_batch(
                &self,
                pairs: GoalPairs<'_>,
                out: &mut [bool],
            ) -> Result<(), GoalError> {
                (**self).truncated_batch(pairs, out)
            }
        }
    )*};
}

reward_through_pointer!(&R, Box<R>, Rc<R>, Arc<R>);
