//! `bench reward`: measures rewards of a million pairs of three-dimensional goals, which read 48 MB
//! and write 8 MB, against a copy that moves as many bytes: 28 MB read and 28 MB written.

use std::{hint::black_box, sync::Arc, time::Duration};

use fetch_env::NpRandom;
use goal_reward::{DistanceReward, GoalPairs, GoalReward};
use serde::Serialize;

use super::{
    interleaved::{Clock, Entry, interleave},
    report,
};
use fetch_cli::shared::json::Metric;

const PAIRS: usize = 1_000_000;
const DIM: usize = 3;
/// Numbers read and written for all pairs.
const MOVED: usize = PAIRS * (2 * DIM + 1);

#[derive(Debug, clap::Args, Serialize)]
pub struct Args {
    /// Seconds of measuring
    #[arg(long, default_value_t = 5, value_parser = clap::value_parser!(u16).range(1..))]
    seconds: u16,
}

pub fn run(args: &Args) -> anyhow::Result<Vec<(String, Metric)>> {
    let mut random = NpRandom::new(0);
    // Both sides of the threshold occur, in an order that a processor cannot predict.
    let mut matrix = || (0..PAIRS * DIM).map(|_| random.uniform(-0.05, 0.05)).collect();
    let goals: Arc<[Vec<f64>; 2]> = Arc::new([matrix(), matrix()]);
    let rewards = |reward: DistanceReward, checked| {
        let (goals, mut rewards) = (Arc::clone(&goals), vec![0.0; PAIRS]);
        move || {
            let pairs = GoalPairs::new(&goals[0], &goals[1], DIM)?;
            if checked {
                reward.try_reward_batch(pairs, &mut rewards)?;
            } else {
                reward.reward_batch(pairs, &mut rewards)?;
            }
            black_box(&mut rewards);
            Ok(MOVED * size_of::<f64>())
        }
    };
    let (from, mut to) = (vec![1.0; MOVED / 2], vec![0.0; MOVED / 2]);
    let copy = move || {
        to.copy_from_slice(black_box(&from));
        black_box(&mut to);
        Ok(MOVED * size_of::<f64>())
    };
    let entries = vec![
        Entry::new("copy", "bytes/s", copy),
        Entry::new("sparse", "bytes/s", rewards(DistanceReward::sparse(), false)),
        Entry::new("dense", "bytes/s", rewards(DistanceReward::dense(), false)),
        Entry::new("checked", "bytes/s", rewards(DistanceReward::dense(), true)),
    ];
    let rounds = interleave(entries, Duration::from_secs(args.seconds.into()))?;
    let ratio = |kind| rounds.ratio(&format!("ratio/{kind}-to-copy"), Clock::Cpu, kind, "copy");
    let ratios = ["sparse", "dense", "checked"].into_iter().filter_map(ratio);
    let mut figures = Vec::new();
    report(&mut figures, "reward", rounds.figures().chain(ratios))?;
    Ok(figures)
}
