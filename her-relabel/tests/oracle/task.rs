//! The task of the random worlds.

use goal_reward::GoalReward;

/// A task whose answers tell the achieved goal from the desired one, and depend on the last bit of
/// each element. Its rewards are small whole numbers, so that every sum of them is exact, and a
/// negative zero.
pub(crate) struct Exceed;

impl GoalReward for Exceed {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        let pairs = achieved_goal.iter().zip(desired_goal).enumerate();
        let exceeding = pairs.filter(|(_, (achieved, desired))| achieved > desired);
        exceeding.fold(-0.0, |sum, (at, _)| sum + f64::from(1_u8 << at))
    }
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal.iter().zip(desired_goal).all(|(achieved, desired)| achieved >= desired)
    }
    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        achieved_goal[0] >= desired_goal[0]
    }
}
