//! Many environments at once, on all cores, each reset as soon as its episode ends.
//!
//! `cargo run --release -p fetch-env --example many_environments`
#![allow(clippy::print_stdout, reason = "an example shows what it does")]

use std::{error::Error, time::Instant};

use fetch_env::{
    NpRandom, make_vec,
    vec_env::{AutoresetMode, VecConfig},
};

const NUM_ENVS: usize = 16;
const EPISODES: usize = 64;

fn main() -> Result<(), Box<dyn Error>> {
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = make_vec("FetchPushDense-v4", NUM_ENVS, config)?;
    // Environment i gets the seed 1 + i.
    envs.reset(Some(1))?;

    let mut random = NpRandom::new(1_000);
    let (mut running, mut returns) = ([0.0; NUM_ENVS], Vec::new());
    let (mut num_steps, start) = (0, Instant::now());
    while returns.len() < EPISODES {
        // One row of four elements for each environment.
        let actions = [0.0; 4 * NUM_ENVS].map(|_: f32| random.uniform(-1.0, 1.0) as f32);
        let step = envs.step(&actions)?;
        num_steps += NUM_ENVS;
        for (row, error) in step.errors() {
            println!("environment {row} failed, the others did not: {error}");
        }
        for (row, episode_return) in running.iter_mut().enumerate() {
            *episode_return += step.reward()[row];
            // There, `observation()` is the first of the next episode, and `next_observation()` the
            // last of the old one.
            if step.terminated()[row] || step.truncated()[row] {
                returns.push(std::mem::take(episode_return));
            }
        }
    }
    let seconds = start.elapsed().as_secs_f64();
    let mean = returns.iter().sum::<f64>() / returns.len() as f64;
    println!("{} episodes of random actions: mean return {mean:.2}", returns.len());
    println!(
        "{:.0} steps per second on {} threads",
        num_steps as f64 / seconds,
        envs.num_threads()
    );
    Ok(())
}

#[test]
fn the_example_runs() -> Result<(), Box<dyn Error>> {
    main()
}
