//! Fills a hindsight replay buffer from many environments, and draws minibatches from it.
//!
//! `cargo run -p fetch-env --example replay_buffer`
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::error::Error;

use fetch_env::{DistanceReward, NpRandom, make_vec, vec_env::VecConfig};
use her_relabel::{Batch, BufferConfig, Dims, GoalStrategy, HerBuffer, Sampler, UnitInterval};

const NUM_ENVS: usize = 8;

fn main() -> Result<(), Box<dyn Error>> {
    let mut envs = make_vec("FetchPush-v4", NUM_ENVS, VecConfig::default())?;
    let dims = Dims { observation: 25, goal: 3, action: 4 };
    let config = BufferConfig::new(100_000, dims).with_num_envs(NUM_ENVS);
    let mut buffer = HerBuffer::<f32>::new(config)?;
    let mut random = NpRandom::new(7);

    // The buffer records whatever the environments return, starting with the reset.
    buffer.record(envs.reset(Some(42))?)?.check()?;
    // Two episodes of 50 steps, and the reset between them.
    for _ in 0..101 {
        let actions = [0.0; 4 * NUM_ENVS].map(|_: f32| random.uniform(-1.0, 1.0) as f32);
        buffer.record(envs.step(&actions)?)?.check()?;
    }
    println!("the buffer holds {} steps", buffer.len());

    // Four of five rows get a goal that their episode achieved later, and the reward for it.
    let reward = DistanceReward::sparse();
    let sampler = Sampler::new(256, GoalStrategy::Future, UnitInterval::from_k(4));
    let mut batch = Batch::<f32>::new();
    for _ in 0..3 {
        sampler.sample(&buffer, &reward, &mut random, &mut batch)?;
        let relabeled = batch.relabeled().filter(|is_new| *is_new).count();
        let reached = batch.reward().iter().filter(|reward| **reward == 0.0).count();
        println!("of 256 rows, {relabeled} have a new goal, and {reached} reach their goal");
    }
    Ok(())
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn Error>> {
    main()
}
