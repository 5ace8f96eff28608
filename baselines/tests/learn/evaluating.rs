//! Evaluations: the evaluated policy is the exported one.

use baselines::learn::{AlgorithmSettings, DdpgSettings, SacSettings, Trainer};
use baselines::{TrainedPolicy, evaluate};

use crate::runs::{Result, make, settings};

/// The seed of a run's first evaluation.
const FIRST_SEED: u64 = 1 << 41;

/// Networks of several widths, with and without normalization, from several seeds.
fn algorithms() -> Vec<AlgorithmSettings> {
    let hidden = [vec![], vec![1], vec![7], vec![16, 33], vec![64, 5, 20]];
    let both = |(number, hidden): (usize, &Vec<usize>)| {
        let (hidden, layer_norm) = (hidden.clone(), number % 2 == 0);
        // The actor that is evaluated is not the one that learns.
        let ddpg = DdpgSettings { average_fraction: 0.3, ..DdpgSettings::default() };
        let ddpg = DdpgSettings { hidden: hidden.clone(), layer_norm, ..ddpg };
        let sac = SacSettings { hidden, layer_norm, ..SacSettings::default() };
        [AlgorithmSettings::Ddpg(ddpg), AlgorithmSettings::Sac(sac)]
    };
    hidden.iter().enumerate().flat_map(both).collect()
}

#[test]
fn the_exported_policy_ends_the_evaluated_episodes_to_the_last_bit() -> Result {
    for (seed, algorithm) in (0..).zip(algorithms()) {
        let mut settings = settings(algorithm);
        // This is the number of rows at a time.
        settings.schedule.evaluation_episodes = 1 + seed as usize;
        settings.schedule.updates_per_cycle = 5;
        let name = format!("{:?}", settings.algorithm);
        let mut trainer = Trainer::new(make, settings, seed, 1)?;
        for evaluations in 0..2 {
            while trainer.counters().updates < 30 * evaluations {
                trainer.cycle()?;
            }
            let row = trainer.evaluate()?;
            let file = trainer.policy("FetchReach-v4")?.to_bytes()?;
            let mut policy = TrainedPolicy::from_bytes(&file)?;
            let count = trainer.settings().schedule.evaluation_episodes;
            let first_seed = FIRST_SEED + evaluations * count as u64;
            let exported = evaluate(&mut make()?, &mut policy, count, first_seed, |_| ())?;
            let summary = exported.summary()?;
            assert_eq!(row.final_distance_mean, summary.final_distance_mean.value, "{name}");
            assert_eq!(row.episode_return_mean, summary.episode_return_mean.value, "{name}");
        }
    }
    Ok(())
}
