//! Exercise 2: dense and sparse rewards along one trajectory.

use baselines::{Policy, RandomPolicy};
use fetch_env::{Env, make};

/// One episode of Reach with both rewards.
pub struct Trajectory {
    pub steps: Vec<Rewards>,
    /// Whether both environments gave the same observations, and a dense reward that is the
    /// negative distance.
    pub same: bool,
}

/// What a step came to.
#[derive(Clone, Copy, Debug)]
pub struct Rewards {
    /// Distance to the goal, in meters.
    pub distance: f64,
    pub dense: f64,
    pub sparse: f64,
}

impl Trajectory {
    /// Steps FetchReachDense-v4 and FetchReach-v4 with the same actions.
    pub fn of(policy: &mut impl Policy, seed: u64) -> anyhow::Result<Self> {
        let mut dense = make("FetchReachDense-v4")?;
        let mut sparse = make("FetchReach-v4")?;
        let mut observation = dense.reset(Some(seed))?.observation;
        let mut same = observation == sparse.reset(Some(seed))?.observation;
        let mut steps = Vec::new();
        loop {
            let action = policy.act(&observation);
            let d = dense.step(&action)?;
            let s = sparse.step(&action)?;
            observation = d.observation;
            let distance = d.info.distance;
            same &= observation == s.observation && d.reward == -distance;
            steps.push(Rewards { distance, dense: d.reward, sparse: s.reward });
            if d.is_last() {
                return Ok(Self { steps, same });
            }
        }
    }
}

pub fn run(seed: u64) -> anyhow::Result<bool> {
    println!(
        "Exercise 2: FetchReachDense-v4 and FetchReach-v4, seed {seed}, the same random actions"
    );
    let Trajectory { steps, same } = Trajectory::of(&mut RandomPolicy::new(seed), seed)?;
    println!("  step  distance     dense  sparse");
    for (t, step) in (1..).zip(&steps) {
        println!("  {t:4}  {:.4} m  {:8.4}  {:6}", step.distance, step.dense, step.sparse);
    }
    let dense_return: f64 = steps.iter().map(|step| step.dense).sum();
    let sparse_return: f64 = steps.iter().map(|step| step.sparse).sum();
    let (reached, missed): (Vec<&Rewards>, Vec<&Rewards>) =
        steps.iter().partition(|step| step.sparse == 0.0);
    let farthest_zero = reached.iter().map(|s| s.distance).fold(f64::NEG_INFINITY, f64::max);
    let nearest_minus_one = missed.iter().map(|s| s.distance).fold(f64::INFINITY, f64::min);
    println!(
        "(a) The dense return is {dense_return:.2}, the sparse one {sparse_return:.2}: the dense is not the more negative."
    );
    println!("(b) The sparse reward is 0 in {} of {} steps.", reached.len(), steps.len());
    println!(
        "(c) It switches at 0.05 m: -1 from {nearest_minus_one:.4} m on in this episode, 0 up to {farthest_zero:.4} m (-inf: never)."
    );
    Ok(same && nearest_minus_one > 0.05 && farthest_zero <= 0.05)
}
