//! Exercise 2: dense and sparse rewards along one trajectory.

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, make};

pub fn run(seed: u64) -> anyhow::Result<bool> {
    println!(
        "Exercise 2: FetchReachDense-v4 and FetchReach-v4, seed {seed}, the same random actions"
    );
    let mut dense = make("FetchReachDense-v4")?;
    let mut sparse = make("FetchReach-v4")?;
    let mut policy = RandomPolicy::new(seed);
    let mut observation = dense.reset(Some(seed))?.observation;
    let mut same = observation == sparse.reset(Some(seed))?.observation;
    let (mut dense_return, mut sparse_return, mut reached) = (0.0, 0.0, 0);
    let (mut farthest_zero, mut nearest_minus_one) = (f64::NEG_INFINITY, f64::INFINITY);
    println!("  step  distance     dense  sparse");
    for t in 1..=50 {
        let action = policy.act(&observation);
        let d = dense.step(&action)?;
        let s = sparse.step(&action)?;
        observation = d.observation;
        same &= observation == s.observation && d.reward == -d.info.distance;
        dense_return += d.reward;
        sparse_return += s.reward;
        if s.reward == 0.0 {
            reached += 1;
            farthest_zero = farthest_zero.max(d.info.distance);
        } else {
            nearest_minus_one = nearest_minus_one.min(d.info.distance);
        }
        println!("  {t:4}  {:.4} m  {:8.4}  {:6}", d.info.distance, d.reward, s.reward);
    }
    println!(
        "(a) The dense return is {dense_return:.2}, the sparse one {sparse_return:.2}: the dense is not the more negative."
    );
    println!("(b) The sparse reward is 0 in {reached} of 50 steps.");
    println!(
        "(c) It switches at 0.05 m: -1 from {nearest_minus_one:.4} m on in this episode, 0 up to {farthest_zero:.4} m (-inf: never)."
    );
    Ok(same && nearest_minus_one > 0.05 && farthest_zero <= 0.05)
}
