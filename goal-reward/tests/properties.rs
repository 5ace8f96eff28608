//! Properties over goals of every dimension.

use std::sync::Arc;

use goal_reward::{
    DistanceReward, DistanceThreshold, GoalPairs, GoalReward, RewardKind, goal_distance,
};
use proptest::prelude::*;

/// Elements that are close together, far apart, or not ordinary numbers.
fn element() -> impl Strategy<Value = f64> {
    prop_oneof![
        8 => -0.1..0.1,
        2 => -1e3..1e3,
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-0.0), Just(1e-310)],
    ]
}

/// A dimension, and two matrices with the same number of goals of that dimension.
fn batch() -> impl Strategy<Value = (usize, Vec<f64>, Vec<f64>)> {
    (1_usize..20, 0_usize..9).prop_flat_map(|(dim, rows)| {
        let goals = || prop::collection::vec(element(), dim * rows);
        (Just(dim), goals(), goals())
    })
}

fn reward() -> impl Strategy<Value = DistanceReward> {
    let kind = prop_oneof![Just(RewardKind::Sparse), Just(RewardKind::Dense)];
    let threshold = (0.0..0.3).prop_filter_map("a threshold", |t| DistanceThreshold::new(t).ok());
    (kind, threshold).prop_map(|(kind, threshold)| DistanceReward::new(kind, threshold))
}

proptest! {
    #[test]
    fn a_batch_gives_the_bits_of_its_rows((dim, achieved, desired) in batch(), reward in reward()) {
        let pairs = GoalPairs::new(&achieved, &desired, dim).unwrap();
        let mut rewards = vec![f64::MIN; pairs.len()];
        let mut successes = vec![false; pairs.len()];
        reward.reward_batch(pairs, &mut rewards).unwrap();
        reward.is_success_batch(pairs, &mut successes).unwrap();
        for (row, (achieved, desired)) in pairs.iter().enumerate() {
            let single = reward.reward(achieved, desired);
            // NaN has many bit patterns and arithmetic may give any of them.
            let same = rewards[row].to_bits() == single.to_bits();
            prop_assert!(same || rewards[row].is_nan() && single.is_nan());
            prop_assert_eq!(successes[row], reward.is_success(achieved, desired));
        }
    }

    #[test]
    fn checks_fail_exactly_when_an_element_is_not_finite((dim, achieved, desired) in batch()) {
        let pairs = GoalPairs::new(&achieved, &desired, dim).unwrap();
        let finite = achieved.iter().chain(&desired).all(|value| value.is_finite());
        prop_assert_eq!(pairs.check_finite().is_ok(), finite);
        let mut out = vec![0.0; pairs.len()];
        prop_assert_eq!(DistanceReward::dense().try_reward_batch(pairs, &mut out).is_ok(), finite);
    }

    #[test]
    fn rewards_lie_in_their_bounds((dim, achieved, desired) in batch(), reward in reward()) {
        let pairs = GoalPairs::new(&achieved, &desired, dim).unwrap();
        let pointers: [&dyn GoalReward; 3] = [&&reward, &Box::new(reward), &Arc::new(reward)];
        for pointer in pointers {
            prop_assert_eq!(pointer.bounds(), reward.bounds());
        }
        let (low, high) = reward.bounds().into_inner();
        for (achieved, desired) in pairs.iter() {
            if achieved.iter().chain(desired).all(|element| element.is_finite()) {
                let reward = reward.reward(achieved, desired);
                prop_assert!(low <= reward && reward <= high, "{reward}");
            }
        }
    }

    #[test]
    fn success_and_reward_agree_with_the_distance(
        (dim, achieved, desired) in batch(),
        reward in reward(),
    ) {
        let pairs = GoalPairs::new(&achieved, &desired, dim).unwrap();
        let sparse = DistanceReward::new(RewardKind::Sparse, reward.threshold());
        for (achieved, desired) in pairs.iter() {
            let distance = goal_distance(achieved, desired);
            let success = sparse.is_success(achieved, desired);
            prop_assert_eq!(success, distance < reward.threshold().get());
            prop_assert!(!success || sparse.reward(achieved, desired) == 0.0);
            prop_assert!(!success || achieved.iter().chain(desired).all(|value| value.is_finite()));
        }
    }

    #[test]
    fn distance_is_symmetric_and_zero_only_for_equal_goals(
        (a, b) in (1_usize..20).prop_flat_map(|dim| {
            let goal = || prop::collection::vec(-1e3..1e3, dim);
            (goal(), goal())
        })
    ) {
        prop_assert_eq!(goal_distance(&a, &b).to_bits(), goal_distance(&b, &a).to_bits());
        prop_assert_eq!(goal_distance(&a, &a).to_bits(), 0);
        prop_assert_eq!(goal_distance(&a, &b) == 0.0, a == b);
        let exact: f64 = a.iter().zip(&b).map(|(x, y)| (x - y).powi(2)).sum::<f64>().sqrt();
        prop_assert!((goal_distance(&a, &b) - exact).abs() <= 1e-12 * exact);
    }
}
