//! Exercise 1: the observation's structure over five seeds, and the range of the goals.

use fetch_env::{Env, GoalObservation, make};

const RESETS: u64 = 5;

pub fn run(seed: u64) -> anyhow::Result<bool> {
    println!("Exercise 1: FetchReachDense-v4 over {RESETS} seeds");
    let mut env = make("FetchReachDense-v4")?;
    let mut goals = Vec::new();
    let mut same_shapes = true;
    for seed in (seed..).take(RESETS as usize) {
        let observation = env.reset(Some(seed))?.observation;
        let goal = observation.desired_goal().to_vec();
        same_shapes &= observation.observation().len() == 10
            && observation.achieved_goal().len() == 3
            && goal.len() == 3;
        println!(
            "  seed {seed}: observation (10,), achieved_goal (3,), desired_goal (3,) {goal:.3?}"
        );
        goals.push(goal);
    }
    for (axis, name) in ["x", "y", "z"].iter().enumerate() {
        let along = || goals.iter().map(|goal| goal[axis]);
        let (low, high) = (along().fold(f64::MAX, f64::min), along().fold(f64::MIN, f64::max));
        println!("  desired_goal {name}: {low:.3} to {high:.3} m");
    }
    let differ = goals.windows(2).all(|pair| pair[0] != pair[1]);
    println!("Same keys and shapes: {same_shapes}. Goals differ: {differ}.");
    Ok(same_shapes && differ)
}
