//! Transformed rewards.

use fetch_env::{
    GoalEnv, GoalEnvExt, GoalPairs, GoalReward, make_kinematic, wrappers::TransformReward,
};

use super::{Result, transform};

#[test]
fn a_transformed_reward_is_transformed_in_hindsight_too() -> Result {
    let plain = make_kinematic("FetchPushDense-v4")?;
    let env = transform(make_kinematic("FetchPushDense-v4")?, f64::exp)?;
    let (achieved, desired) = ([0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [0.1, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let pairs = GoalPairs::new(&achieved, &desired, 3)?;
    let mut rewards = [0.0; 2];
    env.compute_reward_batch(pairs, &mut rewards)?;
    for ((achieved, desired), reward) in pairs.iter().zip(rewards) {
        let expected = plain.compute_reward(achieved, desired)?.exp();
        assert_eq!(env.compute_reward(achieved, desired)?, expected);
        assert_eq!(reward, expected);
        assert_eq!(env.is_success(achieved, desired), plain.is_success(achieved, desired));
    }
    let mut batched = [false; 2];
    env.goal_reward().is_success_batch(pairs, &mut batched)?;
    assert_eq!(batched, [false, true]);
    Ok(())
}

/// A task on a line, in which each predicate is true for different pairs.
#[derive(Debug)]
struct Line;

impl GoalReward for Line {
    fn reward(&self, achieved: &[f64], desired: &[f64]) -> f64 {
        achieved[0] - desired[0]
    }

    fn is_success(&self, achieved: &[f64], desired: &[f64]) -> bool {
        achieved[0] == desired[0]
    }

    fn terminated(&self, achieved: &[f64], desired: &[f64]) -> bool {
        achieved[0] > desired[0]
    }

    fn truncated(&self, achieved: &[f64], desired: &[f64]) -> bool {
        achieved[0] < desired[0]
    }
}

#[test]
fn a_transformed_reward_ends_episodes_as_before() -> Result {
    let reward = TransformReward::with_goal_reward(Line, |reward| 2.0 * reward);
    let (achieved, desired) = ([1.0, 2.0, 3.0], [2.0; 3]);
    let pairs = GoalPairs::new(&achieved, &desired, 1)?;
    let mut rewards = [0.0; 3];
    let [mut success, mut terminated, mut truncated] = [[false; 3]; 3];
    reward.reward_batch(pairs, &mut rewards)?;
    reward.is_success_batch(pairs, &mut success)?;
    reward.terminated_batch(pairs, &mut terminated)?;
    reward.truncated_batch(pairs, &mut truncated)?;
    assert_eq!(rewards, [-2.0, 0.0, 2.0]);
    assert_eq!(success, [false, true, false]);
    assert_eq!(terminated, [false, false, true]);
    assert_eq!(truncated, [true, false, false]);
    for (at, (achieved, desired)) in pairs.iter().enumerate() {
        assert_eq!(reward.reward(achieved, desired), rewards[at]);
        assert_eq!(reward.is_success(achieved, desired), success[at]);
        assert_eq!(reward.terminated(achieved, desired), terminated[at]);
        assert_eq!(reward.truncated(achieved, desired), truncated[at]);
    }
    assert_eq!(format!("{reward:?}"), "TransformReward { reward: Line, .. }");
    Ok(())
}
