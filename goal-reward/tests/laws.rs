//! Behavior that users of the reference environment rely on, at the threshold and for bad goals.

use std::ops::RangeInclusive;
use std::sync::Arc;

use goal_reward::{
    DistanceReward, DistanceThreshold, GoalError, GoalPairs, GoalReward, GoalRole, RewardKind,
    ThresholdError, check_goals, goal_distance,
};

/// The neighbors of 0.05, and 0.05 itself, with the sparse reward and the success of the
/// reference (numpy 2.4.6: `-(d > 0.05).astype(np.float32)` and `d < 0.05`).
const AT_THE_THRESHOLD: [(u64, f64, bool); 3] = [
    (0x3fa9_9999_9999_9999, -0.0, true),
    (0x3fa9_9999_9999_999a, -0.0, false),
    (0x3fa9_9999_9999_999b, -1.0, false),
];

#[test]
fn the_threshold_is_compared_as_the_reference_compares_it() {
    for (bits, reward, success) in AT_THE_THRESHOLD {
        let distance = f64::from_bits(bits);
        for dim in [1, 2, 3, 4, 9] {
            let desired = vec![0.0; dim];
            let mut achieved = desired.clone();
            achieved[dim - 1] = distance;
            let got = DistanceReward::sparse().reward(&achieved, &desired);
            assert_eq!(got.to_bits(), reward.to_bits(), "d = {distance}, dim {dim}");
            assert_eq!(DistanceReward::sparse().is_success(&achieved, &desired), success);
            assert_eq!(DistanceReward::dense().is_success(&achieved, &desired), success);
            assert_eq!(DistanceReward::dense().reward(&achieved, &desired), -distance);
        }
    }
}

#[test]
fn a_reached_goal_gives_negative_zero_in_both_kinds() {
    let goal = [1.3, 0.7, 0.4];
    for reward in [DistanceReward::sparse(), DistanceReward::dense()] {
        assert_eq!(reward.reward(&goal, &goal).to_bits(), (-0.0_f64).to_bits());
        assert!(reward.is_success(&goal, &goal));
        assert!(!reward.terminated(&goal, &goal));
        assert!(!reward.truncated(&goal, &goal));
    }
}

#[test]
fn a_threshold_of_zero_rewards_only_the_goal_itself_and_never_succeeds() {
    let threshold = DistanceThreshold::new(0.0).unwrap();
    let reward = DistanceReward::new(RewardKind::Sparse, threshold);
    assert_eq!(reward.reward(&[2.0], &[2.0]), 0.0);
    assert!(!reward.is_success(&[2.0], &[2.0]));
    assert_eq!(reward.reward(&[2.0], &[2.5]), -1.0);
}

#[test]
fn unchecked_calls_never_call_a_bad_goal_a_success() {
    let bad: [(&[f64], &[f64]); 5] = [
        (&[f64::NAN, 0.0, 0.0], &[0.0, 0.0, 0.0]),
        (&[f64::INFINITY, 0.0, 0.0], &[f64::INFINITY, 0.0, 0.0]),
        (&[0.0, 0.0, 0.0], &[f64::NEG_INFINITY, 0.0, 0.0]),
        (&[0.0, 0.0], &[0.0, 0.0, 0.0]),
        (&[], &[0.0]),
    ];
    for (achieved, desired) in bad {
        let sparse = DistanceReward::sparse();
        assert_eq!(sparse.reward(achieved, desired), -1.0, "{achieved:?} {desired:?}");
        assert!(!sparse.is_success(achieved, desired));
        assert!(!DistanceReward::dense().reward(achieved, desired).is_finite());
    }
    assert!(DistanceReward::dense().reward(&[f64::NAN], &[0.0]).is_nan());
    assert!(goal_distance(&[0.0, 0.0], &[0.0]).is_nan());
}

#[test]
fn checked_calls_name_the_goal_the_element_and_the_value() {
    let reward = DistanceReward::sparse();
    let error = reward.try_reward(&[0.0, f64::INFINITY], &[0.0, 0.0]).unwrap_err();
    let expected =
        GoalError::NotFinite { role: GoalRole::Achieved, row: 0, index: 1, value: f64::INFINITY };
    assert_eq!(error, expected);
    assert!(error.to_string().starts_with("achieved_goal[1] is inf"));

    let mismatch = GoalError::LengthMismatch { achieved: 2, desired: 3 };
    assert_eq!(reward.try_reward(&[0.0; 2], &[0.0; 3]), Err(mismatch));
    assert_eq!(check_goals(&[], &[]), Err(GoalError::Empty));
    assert_eq!(reward.try_reward(&[0.0; 3], &[0.0; 3]), Ok(0.0));
}

#[test]
fn a_checked_batch_names_the_row_and_leaves_the_output() {
    let achieved = [0.0; 6];
    let mut desired = [0.0; 6];
    desired[5] = f64::NAN;
    let pairs = GoalPairs::new(&achieved, &desired, 3).unwrap();
    let mut out = [7.0; 2];
    let error = DistanceReward::sparse().try_reward_batch(pairs, &mut out).unwrap_err();
    assert!(matches!(
        error,
        GoalError::NotFinite { role: GoalRole::Desired, row: 1, index: 2, .. }
    ));
    assert_eq!(out, [7.0; 2]);
    DistanceReward::sparse().reward_batch(pairs, &mut out).unwrap();
    assert_eq!(out, [0.0, -1.0]);
}

#[test]
fn sizes_that_do_not_fit_are_errors() {
    assert_eq!(GoalPairs::new(&[], &[], 0), Err(GoalError::Empty));
    assert_eq!(
        GoalPairs::new(&[0.0; 4], &[0.0; 4], 3),
        Err(GoalError::PartialRow { len: 4, dim: 3 })
    );
    assert_eq!(
        GoalPairs::new(&[0.0; 3], &[0.0; 6], 3),
        Err(GoalError::LengthMismatch { achieved: 3, desired: 6 })
    );
    let pairs = GoalPairs::new(&[0.0; 6], &[0.0; 6], 3).unwrap();
    let too_long = GoalError::OutputLength { expected: 2, actual: 3 };
    let reward = DistanceReward::sparse();
    assert_eq!(reward.reward_batch(pairs, &mut [0.0; 3]), Err(too_long));
    assert_eq!(reward.try_reward_batch(pairs, &mut [0.0; 3]), Err(too_long));
    assert_eq!(reward.is_success_batch(pairs, &mut [false; 3]), Err(too_long));
    assert_eq!(reward.terminated_batch(pairs, &mut [false; 3]), Err(too_long));
    assert_eq!(reward.truncated_batch(pairs, &mut [false; 3]), Err(too_long));
    let empty = GoalPairs::new(&[], &[], 3).unwrap();
    assert!(empty.is_empty());
    assert_eq!(reward.reward_batch(empty, &mut []), Ok(()));
}

#[test]
fn a_threshold_is_finite_and_not_negative() {
    for bad in [-1e-300, f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        assert!(matches!(DistanceThreshold::new(bad), Err(ThresholdError { .. })), "{bad}");
    }
    assert_eq!(DistanceThreshold::FETCH, DistanceThreshold::new(0.05).unwrap());
}

#[test]
fn settings_survive_serde_and_bad_ones_are_rejected() {
    let reward = DistanceReward::new(RewardKind::Dense, DistanceThreshold::new(0.02).unwrap());
    let text = serde_json::to_string(&reward).unwrap();
    assert_eq!(text, r#"{"kind":"dense","threshold":0.02}"#);
    assert_eq!(serde_json::from_str::<DistanceReward>(&text).unwrap(), reward);
    let error = serde_json::from_str::<DistanceThreshold>("-0.02").unwrap_err();
    assert!(error.to_string().contains("the distance threshold is -0.02: choose a finite number"));
}

#[test]
fn errors_print_their_message_for_debugging_too() {
    let errors: [&dyn std::error::Error; 3] = [
        &GoalError::PartialRow { len: 4, dim: 3 },
        &DistanceThreshold::new(-1.0).unwrap_err(),
        &"Dense".parse::<RewardKind>().unwrap_err(),
    ];
    for error in errors {
        assert_eq!(format!("{error:?}"), error.to_string());
    }
}

#[test]
fn kinds_are_written_and_parsed_by_one_name() {
    for kind in [RewardKind::Sparse, RewardKind::Dense] {
        assert_eq!(kind.to_string().parse(), Ok(kind));
    }
    let error = "Dense".parse::<RewardKind>().unwrap_err();
    assert!(error.to_string().contains("write `sparse` or `dense`"));
}

/// A reward that overrides everything, to test that pointers forward every method.
struct Overridden;

impl GoalReward for Overridden {
    fn reward(&self, _: &[f64], _: &[f64]) -> f64 {
        1.0
    }
    fn is_success(&self, _: &[f64], _: &[f64]) -> bool {
        false
    }
    fn bounds(&self) -> RangeInclusive<f64> {
        1.0..=2.0
    }
    fn terminated(&self, achieved_goal: &[f64], _: &[f64]) -> bool {
        achieved_goal[0] > 0.0
    }
    fn truncated(&self, achieved_goal: &[f64], _: &[f64]) -> bool {
        achieved_goal[0] < 0.0
    }
    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        pairs.map_into(out, |_, _| 2.0)
    }
    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        pairs.map_into(out, |_, _| true)
    }
}

#[test]
fn rewards_behind_pointers_keep_their_overrides() {
    let pairs = GoalPairs::new(&[1.0, -1.0], &[0.0, 0.0], 1).unwrap();
    let through: [Box<dyn GoalReward>; 3] =
        [Box::new(&Overridden), Box::new(Arc::new(Overridden)), Box::new(Overridden)];
    for reward in through {
        let (mut rewards, mut flags) = ([0.0; 2], [false; 2]);
        reward.reward_batch(pairs, &mut rewards).unwrap();
        assert_eq!(rewards, [2.0; 2]);
        reward.is_success_batch(pairs, &mut flags).unwrap();
        assert_eq!(flags, [true; 2]);
        reward.terminated_batch(pairs, &mut flags).unwrap();
        assert_eq!(flags, [true, false]);
        reward.truncated_batch(pairs, &mut flags).unwrap();
        assert_eq!(flags, [false, true]);
        assert_eq!(reward.try_reward(&[1.0], &[0.0]), Ok(1.0));
        assert_eq!(reward.bounds(), 1.0..=2.0);
    }
}
