//! Plans with snapshots: tries many actions from the same state, and takes the best of them.
//!
//! `cargo run -p fetch-env --example look_ahead`
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;

use fetch_env::{Env, NpRandom, SnapshotEnv, make};

/// The number of actions tried in each state.
const TRIALS: usize = 16;

fn main() -> Result<(), Box<dyn Error>> {
    let mut env = make("FetchReachDense-v4")?;
    env.reset(Some(3))?;
    let mut random = NpRandom::new(0);
    loop {
        // A snapshot holds the whole state: physics, goal, step count and random numbers.
        let snapshot = env.snapshot();
        let (mut best, mut best_reward) = ([0.0; 4], f64::NEG_INFINITY);
        for _ in 0..TRIALS {
            let action = [0.0; 4].map(|_: f32| random.uniform(-1.0, 1.0) as f32);
            let reward = env.step(&action)?.reward;
            if reward > best_reward {
                (best, best_reward) = (action, reward);
            }
            env.restore(&snapshot)?;
        }
        let step = env.step(&best)?;
        // The same action from the same state leads to the same bits.
        assert_eq!(step.reward, best_reward);
        if step.is_last() {
            println!("{:.3} m from the goal: success {}", step.info.distance, step.info.is_success);
            return Ok(());
        }
    }
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn Error>> {
    main()
}
