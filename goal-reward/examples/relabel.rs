//! Hindsight: an arm that missed its goal is rewarded for the place that it reached.
//!
//! `cargo run -p goal-reward --example relabel`
#![allow(clippy::print_stdout, reason = "an example prints what it computes")]

use goal_reward::{DistanceReward, GoalError, GoalPairs, GoalReward};

fn main() -> Result<(), GoalError> {
    // The gripper's position after each of four steps: the achieved goals, row after row.
    let achieved = [[1.30, 0.75, 0.53], [1.34, 0.75, 0.53], [1.38, 0.75, 0.53], [1.42, 0.75, 0.53]];
    let desired = [[1.30, 0.75, 0.80]; 4];
    let new_goal = [achieved[3]; 4];

    let reward = DistanceReward::sparse();
    let mut rewards = [0.0; 4];
    for (name, goals) in [("desired goal", desired), ("last achieved goal", new_goal)] {
        let pairs = GoalPairs::new(achieved.as_flattened(), goals.as_flattened(), 3)?;
        reward.reward_batch(pairs, &mut rewards)?;
        println!("{name}: {rewards:?}");
    }
    Ok(())
}
