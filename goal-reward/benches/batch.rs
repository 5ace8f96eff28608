//! Rewards of a thousand pairs, which fit in the cache: `cargo bench -p goal-reward`.
//! `cargo xtask bench reward` measures a million pairs against the speed of memory.
#![allow(missing_docs)] // for the macros' output

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use goal_reward::{DistanceReward, GoalPairs, GoalReward};

fn batch(criterion: &mut Criterion) {
    const PAIRS: usize = 1000;
    let mut group = criterion.benchmark_group("reward-batch");
    group.throughput(Throughput::Elements(PAIRS as u64));
    for dim in [3, 4, 25] {
        let goals = |factor: usize| -> Vec<f64> {
            (0..PAIRS * dim).map(|at| (at * factor % 101) as f64 * 1e-3).collect()
        };
        let (achieved, desired) = (goals(37), goals(53));
        let pairs = GoalPairs::new(&achieved, &desired, dim).expect("whole rows");
        let mut rewards = vec![0.0; PAIRS];
        for (kind, reward) in
            [("sparse", DistanceReward::sparse()), ("dense", DistanceReward::dense())]
        {
            group.bench_function(BenchmarkId::new(kind, dim), |bencher| {
                bencher.iter(|| reward.reward_batch(pairs, &mut rewards).expect("enough room"));
            });
        }
        group.bench_function(BenchmarkId::new("checked", dim), |bencher| {
            let reward = DistanceReward::sparse();
            bencher.iter(|| reward.try_reward_batch(pairs, &mut rewards).expect("finite goals"));
        });
    }
    group.finish();
}

criterion_group!(benches, batch);
criterion_main!(benches);
