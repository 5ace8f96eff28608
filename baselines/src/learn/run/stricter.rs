//! A reward that is harder to earn than the environment's.

use std::ops::RangeInclusive;

use goal_reward::{GoalError, GoalPairs, GoalReward};

/// The reward of an environment as if each achieved goal were `distance_factor` times as far from
/// the desired one as it is: with 2, whatever counts as reached within 5 cm does so within 2.5 cm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Stricter<'a, R> {
    pub(super) reward: &'a R,
    pub(super) distance_factor: f64,
}

impl<R: GoalReward> Stricter<'_, R> {
    /// Returns achieved goals, each moved away from its desired goal.
    fn away(&self, achieved_goals: &[f64], desired_goals: &[f64]) -> Vec<f64> {
        let elements = achieved_goals.iter().zip(desired_goals);
        elements
            .map(|(achieved, desired)| desired + (achieved - desired) * self.distance_factor)
            .collect()
    }

    /// Passes pairs on; unchanged if the factor is 1, which would round.
    fn with_moved<T>(
        &self,
        pairs: GoalPairs<'_>,
        pass: impl FnOnce(GoalPairs<'_>) -> Result<T, GoalError>,
    ) -> Result<T, GoalError> {
        if self.distance_factor == 1.0 {
            return pass(pairs);
        }
        let moved = self.away(pairs.achieved(), pairs.desired());
        pass(GoalPairs::new(&moved, pairs.desired(), pairs.dim())?)
    }

    fn with_moved_goal<T>(
        &self,
        achieved_goal: &[f64],
        desired_goal: &[f64],
        pass: impl FnOnce(&R, &[f64], &[f64]) -> T,
    ) -> T {
        if self.distance_factor == 1.0 {
            return pass(self.reward, achieved_goal, desired_goal);
        }
        pass(self.reward, &self.away(achieved_goal, desired_goal), desired_goal)
    }
}

impl<R: GoalReward> GoalReward for Stricter<'_, R> {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        self.with_moved_goal(achieved_goal, desired_goal, R::reward)
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.with_moved_goal(achieved_goal, desired_goal, R::is_success)
    }

    fn bounds(&self) -> RangeInclusive<f64> {
        self.reward.bounds()
    }

    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.with_moved_goal(achieved_goal, desired_goal, R::terminated)
    }

    fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.with_moved_goal(achieved_goal, desired_goal, R::truncated)
    }

    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        self.with_moved(pairs, |pairs| self.reward.reward_batch(pairs, out))
    }

    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.with_moved(pairs, |pairs| self.reward.is_success_batch(pairs, out))
    }

    fn terminated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.with_moved(pairs, |pairs| self.reward.terminated_batch(pairs, out))
    }

    fn truncated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.with_moved(pairs, |pairs| self.reward.truncated_batch(pairs, out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use goal_reward::DistanceReward;

    #[test]
    fn a_goal_counts_as_reached_from_as_many_times_closer() {
        let reward = &DistanceReward::sparse();
        let (plain, strict) =
            (Stricter { reward, distance_factor: 1.0 }, Stricter { reward, distance_factor: 2.0 });
        for (distance, by_plain, by_strict) in
            [(0.024, 0.0, 0.0), (0.026, 0.0, -1.0), (0.051, -1.0, -1.0)]
        {
            let (achieved, desired) = ([1.0, 0.5 + distance, 0.25], [1.0, 0.5, 0.25]);
            assert_eq!(plain.reward(&achieved, &desired), by_plain, "{distance}");
            assert_eq!(strict.reward(&achieved, &desired), by_strict, "{distance}");
            assert_eq!(strict.is_success(&achieved, &desired), by_strict == 0.0);
            let mut rewards = [f64::NAN];
            let pairs = GoalPairs::new(&achieved, &desired, 3).unwrap();
            strict.reward_batch(pairs, &mut rewards).unwrap();
            assert_eq!(rewards, [by_strict]);
        }
    }
}
