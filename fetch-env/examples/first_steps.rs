//! First steps: makes an environment, and moves the gripper straight to the goal.
//!
//! `cargo run -p fetch-env --example first_steps`
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;

use fetch_env::{Env, GoalEnvExt, GoalObservation, make};

fn main() -> Result<(), Box<dyn Error>> {
    let mut env = make("FetchReach-v4")?;
    println!("an action has {} elements from -1 to 1", env.action_space().len());

    // The same seed gives the same goal as in Python.
    let mut observation = env.reset(Some(42))?.observation;
    println!("the gripper is at {:.3?} m", observation.achieved_goal());
    println!("it should be at   {:.3?} m", observation.desired_goal());

    loop {
        // One unit of an action moves the gripper by up to 5 cm; the fourth element moves the
        // fingers.
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        let [dx, dy, dz] = [0, 1, 2].map(|axis| ((desired[axis] - achieved[axis]) / 0.05) as f32);
        let step = env.step(&[dx, dy, dz, 0.0])?;
        // The reward depends only on the two goals: hindsight relabeling relies on that.
        let (achieved, desired) =
            (step.observation.achieved_goal(), step.observation.desired_goal());
        assert_eq!(step.reward, env.compute_reward(achieved, desired)?);
        if step.is_last() {
            println!(
                "after 50 steps it is {:.4} m away: success {}",
                step.info.distance, step.info.is_success
            );
            return Ok(());
        }
        observation = step.observation;
    }
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn Error>> {
    main()
}
