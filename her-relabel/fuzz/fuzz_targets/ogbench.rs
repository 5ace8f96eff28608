//! Importing any archive of OGBench gives episodes that can be sampled, or an error that changes
//! nothing.
#![no_main]

mod common;
mod files;

use common::{DIMS, draw};
use files::Input;
use goal_reward::DistanceReward;
use her_relabel::{BufferConfig, GoalColumns, HerBuffer};
use libfuzzer_sys::fuzz_target;

/// Two trajectories of three states, written by numpy.
const GOOD: &[u8] = include_bytes!("trajectories.npz");

fuzz_target!(|input: Input| {
    let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(8, DIMS)).expect("a buffer");
    let goals = GoalColumns { array: "achieved_goals", width: 1, columns: 0..1, desired: None };
    let reward = DistanceReward::sparse();
    assert_eq!(buffer.import_ogbench_bytes(GOOD, &goals, &reward).ok(), Some(2));
    let before = (draw(&buffer), buffer.transition_ids());
    match buffer.import_ogbench_bytes(&input.apply(GOOD.to_vec()), &goals, &reward) {
        Ok(_) => drop(draw(&buffer)),
        Err(_) => assert_eq!(before, (draw(&buffer), buffer.transition_ids())),
    }
});
