//! A process that was forked draws the batches of its parent, without the parent's threads.
#![cfg(all(unix, not(miri)))]

use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::{Command, ExitStatus, abort};
use std::thread;
use std::time::Duration;

use fork::{Fork, fork, waitpid};
use goal_reward::DistanceReward;
use her_relabel::{
    Batch, BufferConfig, Dims, EpisodeData, GoalStrategy, HerBuffer, Sampler, UnitInterval,
};

type Result<T = (), E = Box<dyn std::error::Error>> = std::result::Result<T, E>;

/// Longer than any call here takes. A child that still waits after it is ended.
const FOREVER: Duration = Duration::from_secs(60);

#[test]
fn a_forked_process_draws_the_same_batches() -> Result {
    let config = BufferConfig::new(1000, Dims { observation: 1, goal: 1, action: 1 });
    let mut buffer = HerBuffer::<f64>::new(config)?;
    let places: Vec<f64> = (0..=500).map(f64::from).collect();
    buffer.add_episode(&EpisodeData {
        observation: &places,
        achieved_goal: &places,
        desired_goal: &[-1.0],
        action: &places[1..],
        reward: &[-1.0; 500],
        terminated: false,
        truncated: true,
        fields: &[],
    })?;
    let sampler = Sampler::new(5000, GoalStrategy::Future, UnitInterval::from_k(4));
    let sampler = sampler.with_parallel(true);
    let draw = |seed: u64| {
        let mut batch = Batch::<f64>::new();
        sampler.sample(&buffer, &DistanceReward::sparse(), seed, &mut batch).map(|()| batch)
    };
    let expected = draw(3)?;
    match fork()? {
        Fork::Parent(child) => {
            let status = ExitStatus::from_raw(waitpid(child)?);
            assert!(status.success(), "the child: {status}");
        }
        Fork::Child => {
            thread::spawn(|| {
                thread::sleep(FOREVER);
                abort();
            });
            let is_same = AssertUnwindSafe(|| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build();
                let in_pool = pool.map(|pool| pool.install(|| draw(3)));
                draw(3).as_ref() == Ok(&expected) && in_pool.is_ok_and(|batch| batch == draw(3))
            });
            let is_same = catch_unwind(is_same).unwrap_or_default();
            // Another program takes over, so that the child does not return to the harness.
            let _failure = Command::new(if is_same { "true" } else { "false" }).exec();
            abort();
        }
    }
    assert!(draw(3)? == expected);
    Ok(())
}
