//! Exercise 4: success against the distance threshold.

use fetch_env::EnvId;
use fetch_sim::Task;
use goal_reward::RewardKind;

use crate::random_episodes::evaluate_random;

const EPISODES: usize = 100;
const THRESHOLDS: [f64; 5] = [0.01, 0.02, 0.05, 0.10, 0.20];

pub fn run(seed: u64) -> anyhow::Result<bool> {
    let id = EnvId { task: Task::Reach, reward: RewardKind::Dense };
    println!("Exercise 4: {id}, {EPISODES} random episodes from seed {seed}");
    println!("  threshold  success at the last step (95 % interval)");
    let rates = evaluate_random(id, seed, EPISODES)?.success_at(&THRESHOLDS)?;
    for (threshold, rate) in THRESHOLDS.iter().zip(&rates) {
        println!("  {threshold:7.2} m  {:5.3}  ({:.3} to {:.3})", rate.value, rate.low, rate.high);
    }
    println!(
        "The wider the threshold, the easier the task; at the benchmark's 0.05 m chance hardly ever succeeds."
    );
    Ok(rates.is_sorted_by(|a, b| a.value <= b.value) && rates[2].value < 0.1)
}
