//! Training settings are rejected, or they train.
#![no_main]

mod small;

use baselines::learn::{AlgorithmSettings, TrainError, TrainSettings, Trainer};
use libfuzzer_sys::fuzz_target;
use small::{Algorithm, make, settings, train};
use testing::Input;

/// The most work of a run, in steps and in products of an update.
const MOST_STEPS: usize = 1_000;
const MOST_PRODUCTS: usize = 5_000_000;

/// Whether the settings are those of a run that takes milliseconds.
fn is_short(settings: &TrainSettings) -> bool {
    let schedule = &settings.schedule;
    let steps = schedule.num_envs * schedule.steps_per_cycle;
    let drawn = schedule.updates_per_cycle * settings.replay.batch_size;
    let (hidden, rows) = match &settings.algorithm {
        AlgorithmSettings::Ddpg(ddpg) => (&ddpg.hidden, drawn),
        AlgorithmSettings::Sac(sac) => (&sac.hidden, drawn),
        // A step of the optimizer costs as much as a row, however few it has.
        AlgorithmSettings::Ppo(ppo) => (&ppo.hidden, ppo.epochs * ppo.minibatches.max(steps)),
        _ => return false,
    };
    let widths = [&[17], hidden.as_slice(), &[8]].concat();
    let products: usize = widths.windows(2).map(|pair| pair[0] * pair[1]).sum();
    steps <= MOST_STEPS && schedule.evaluation_episodes <= 2 && rows * products <= MOST_PRODUCTS
}

fuzz_target!(|input: (Algorithm, Input)| {
    let (algorithm, input) = input;
    let Some(settings) = input.apply(&settings(algorithm)) else { return };
    match settings.check() {
        Ok(()) if is_short(&settings) => {
            let mut trainer = Trainer::new(make, settings, 0, 1).expect("settings in range");
            let _ = train(&mut trainer);
        }
        Ok(()) => {}
        Err(error @ (TrainError::Setting { .. } | TrainError::Unused { .. })) => {
            let refused = Trainer::new(make, settings, 0, 1).expect_err("a setting out of range");
            assert_eq!(refused.to_string(), error.to_string());
        }
        Err(error) => panic!("{error}"),
    }
});
