//! Adds random episodes of FetchPush to a replay buffer, and draws batches with and without
//! hindsight.
//!
//! `cargo run --release -p fetch-baselines --example hindsight`
#![allow(clippy::print_stdout, reason = "an example prints its result")]

use baselines::{RandomPolicy, buffer_config, collect};
use fetch_env::{Env, GoalEnv, NpRandom, make};
use her_relabel::{Batch, GoalStrategy, HerBuffer, Sampler, UnitInterval};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut env = make("FetchPush-v4")?;
    let mut buffer = HerBuffer::<f32>::new(buffer_config(100_000, &env)?)?;
    let mut policy = RandomPolicy::new(env.action_space(), 1);
    collect(&mut env, &mut policy, 20, 1, &mut buffer, 0, |_| ())?;
    println!("{} transitions of {} episodes", buffer.len(), buffer.num_episodes());

    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::<f64>::new();
    let mut random = NpRandom::new(2);
    for (name, ratio) in [("as it was", UnitInterval::ZERO), ("in hindsight", sampler.ratio())] {
        sampler.with_ratio(ratio).sample(&buffer, env.goal_reward(), &mut random, &mut batch)?;
        let reached = batch.reward().iter().filter(|reward| **reward == 0.0).count();
        println!("{name}: {reached} of {} rows reach their goal", batch.len());
    }
    Ok(())
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn std::error::Error>> {
    main()
}
