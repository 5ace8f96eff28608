//! Settings: each has a range, and every number in it trains.

use allocation_counter::measure;
use baselines::learn::{
    AlgorithmInit, AlgorithmSettings, Ddpg, DdpgSettings, Preset, RunError, Sac, SacSettings,
    TrainError, TrainSettings, Trainer,
};
use fetch_env::Task;
use serde_json::Value;

use crate::runs::{Result, ddpg, make, ppo, sac, settings};
use testing::{Number, numbers, with_number_replaced};

/// The values that are tried in place of every fraction.
const FRACTIONS: [f64; 10] =
    [-1.0, 0.0, 0.5, 2.0, 9.0, 1e-40, 1e39, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
/// The values that are tried in place of every whole number.
const INTEGERS: [u64; 7] = [0, 1, 2, 1_000_000, 1_000_000_000_000, u64::MAX / 2, u64::MAX];

/// More memory than any of the tried settings takes at the start.
const MOST_BYTES: u64 = 1 << 30;

/// Settings of a small run of each algorithm.
fn small() -> [TrainSettings; 3] {
    [ddpg(), sac(), ppo()].map(|algorithm| {
        let mut settings = settings(algorithm);
        settings.schedule.num_envs = 1;
        settings.schedule.evaluation_episodes = 1;
        if let AlgorithmSettings::Ppo(_) = settings.algorithm {
            return settings;
        }
        settings.replay.batch_size = 16;
        settings.exploration.random_episodes = 1;
        settings.schedule.updates_per_cycle = 2;
        settings
    })
}

/// Stands for the name of a setting that has no effect.
const UNUSED: &str = "unused";

/// Returns the settings with one number replaced, if they can be deserialized.
fn replaced(value: &Value, number: &Value, by: Number) -> Option<TrainSettings> {
    with_number_replaced(value, number, by).ok()
}

/// Makes a trainer, lets it train, and returns the name of the setting that it refuses.
fn refused(settings: TrainSettings) -> Option<&'static str> {
    let checked = match settings.check() {
        Ok(()) => None,
        Err(TrainError::Setting { name, .. }) => Some(name),
        Err(TrainError::Unused { .. }) => Some(UNUSED),
        Err(error) => panic!("{error}"),
    };
    let text = format!("{settings:?}");
    let mut outcome = None;
    let memory = measure(|| outcome = Some(train(settings)));
    assert!(memory.bytes_max < MOST_BYTES, "{} bytes: {text}", memory.bytes_max);
    match outcome.expect("it ran") {
        Err(TrainError::Setting { name, .. }) => assert_eq!(Some(name), checked),
        Err(TrainError::Unused { .. }) => assert_eq!(Some(UNUSED), checked),
        // Numbers in their ranges may still be too extreme to learn with.
        Ok(()) => assert_eq!(checked, None, "{text}"),
        Err(TrainError::Run { source, .. }) if matches!(*source, RunError::Diverged { .. }) => {
            assert_eq!(checked, None, "{text}");
        }
        Err(error) => panic!("{error}: {text}"),
    }
    checked
}

fn train(settings: TrainSettings) -> Result<(), TrainError> {
    let mut trainer = Trainer::new(make, settings, 0, 1)?;
    trainer.cycle()?;
    trainer.evaluate().map(drop)
}

#[test]
fn every_number_is_refused_or_trains() -> Result {
    for settings in small() {
        let value = serde_json::to_value(&settings)?;
        for number in numbers(&value) {
            let all = if number.is_f64() {
                FRACTIONS.map(Number::Float).to_vec()
            } else {
                INTEGERS.map(Number::Integer).to_vec()
            };
            let tried: Vec<_> =
                all.into_iter().filter_map(|by| replaced(&value, number, by)).collect();
            let refused = tried.iter().cloned().filter_map(refused).count();
            // Nothing may be negative, infinite or enormous.
            assert!(refused >= 2, "{tried:?}");
        }
    }
    Ok(())
}

#[test]
fn both_ends_of_every_range_are_in_it() -> Result {
    for settings in small() {
        let value = serde_json::to_value(&settings)?;
        for number in numbers(&value) {
            let too_much =
                if number.is_f64() { Number::Float(f64::MAX) } else { Number::Integer(u64::MAX) };
            let settings = replaced(&value, number, too_much).ok_or("a setting is no number")?;
            let Err(TrainError::Setting { name, expected, .. }) = settings.check() else {
                panic!("{settings:?}");
            };
            let ends = expected.strip_prefix("choose from ").and_then(|text| {
                let (least, rest) = text.split_once(" to ")?;
                let most = rest.split_once(' ').map_or(rest, |(most, _)| most);
                Some([least, most].map(|end| end.replace('_', "")))
            });
            for end in ends.ok_or(expected)? {
                let end = match end.parse() {
                    Ok(integer) if !number.is_f64() => Number::Integer(integer),
                    _ => Number::Float(end.parse()?),
                };
                let settings = replaced(&value, number, end).ok_or("a setting is no number")?;
                if ["updates_per_cycle", "evaluation_episodes"].contains(&name) {
                    // Their largest values take minutes.
                    assert!(matches!(settings.check(), Ok(()) | Err(TrainError::Unused { .. })));
                } else {
                    let refused = refused(settings).filter(|name| *name != UNUSED);
                    assert_eq!(refused, None, "{name}: {end:?}");
                }
            }
        }
    }
    Ok(())
}

#[test]
fn presets_are_in_range() -> Result {
    for task in Task::ALL {
        let settings = TrainSettings::fast(task);
        settings.check()?;
        TrainSettings::book(task).check()?;
        let algorithm = AlgorithmSettings::Sac(SacSettings::default());
        TrainSettings { algorithm, ..settings }.check()?;
    }
    TrainSettings::authors().check()?;
    TrainSettings::fast_ppo().check()?;
    TrainSettings::book_ppo().check()?;
    Ok(TrainSettings::default().check()?)
}

#[test]
fn optional_settings_out_of_range_and_too_many_layers_are_named() {
    type Change = fn(&mut TrainSettings, &mut DdpgSettings);
    // The laws above change numbers that are there.
    let wrong: [(&str, Change); 4] = [
        ("evaluation_interval", |all, _| all.schedule.evaluation_interval = Some(0)),
        ("n_step_updates", |all, _| all.replay.n_step_updates = Some(u64::MAX)),
        ("halving_interval", |_, ddpg| ddpg.halving_interval = Some(0)),
        ("hidden", |_, ddpg| ddpg.hidden = vec![32; 5]),
    ];
    for (setting, change) in wrong {
        let mut all = settings(ddpg());
        let mut ddpg = DdpgSettings::default();
        change(&mut all, &mut ddpg);
        all.algorithm = AlgorithmSettings::Ddpg(ddpg);
        assert_eq!(refused(all), Some(setting));
    }
}

#[test]
fn algorithms_refuse_settings_and_lengths_by_themselves() {
    let wrong = SacSettings { initial_temperature: -1.0, ..SacSettings::default() };
    let bounded = |num_inputs, num_actions, reward_bounds| AlgorithmInit {
        num_inputs,
        num_actions,
        reward_bounds,
        seed: 0,
        rank: 0,
    };
    let init = |num_inputs, num_actions| bounded(num_inputs, num_actions, -1.0..=0.0);
    let empty = DdpgSettings { hidden: vec![0], ..Default::default() };
    let other = AlgorithmSettings::Other("own".into());
    let refused = [
        ("hidden", Ddpg::new(empty, init(13, 4)).map(drop)),
        ("num_inputs", Ddpg::new(DdpgSettings::default(), init(0, 4)).map(drop)),
        ("num_inputs", Ddpg::new(DdpgSettings::default(), init(1_000_000_000_000, 4)).map(drop)),
        ("initial_temperature", Sac::new(wrong, init(13, 4)).map(drop)),
        ("num_actions", Sac::new(SacSettings::default(), init(13, usize::MAX)).map(drop)),
        ("num_actions", sac().build(init(13, 0)).map(drop)),
        ("algorithm", other.build(init(13, 4)).map(drop)),
        ("reward_bounds", ddpg().build(bounded(13, 4, 0.0..=-1.0)).map(drop)),
        ("reward_bounds", sac().build(bounded(13, 4, f64::NAN..=1.0)).map(drop)),
    ];
    for (setting, result) in refused {
        match result {
            Err(TrainError::Setting { name, .. }) => assert_eq!(name, setting),
            other => panic!("{setting}: {other:?}"),
        }
    }
}

/// Returns every setting with its name.
fn named(value: &Value) -> Vec<(&String, &Value)> {
    let entries = value.as_object().into_iter().flatten();
    let all = entries.map(|(name, value)| match value {
        Value::Object(_) => named(value),
        _ => vec![(name, value)],
    });
    all.flatten().collect()
}

/// So that a checkpoint stays readable when a later version has one setting more.
#[test]
fn a_setting_that_a_file_lacks_has_its_default() -> Result {
    let chosen = TrainSettings::fast(Task::Push);
    for part in ["replay", "inputs", "exploration", "schedule"] {
        let (mut value, mut expected) =
            (serde_json::to_value(&chosen)?, serde_json::to_value(&chosen)?);
        value[part] = serde_json::json!({});
        expected[part] = serde_json::to_value(TrainSettings::default())?[part].clone();
        let read = TrainSettings::from_json(&value.to_string())?;
        assert_eq!(serde_json::to_value(read)?, expected, "{part}");
        assert_ne!(serde_json::to_value(&chosen)?, expected, "{part}");
        value[part] = serde_json::json!({ "of_a_later_version": 1 });
        assert!(TrainSettings::from_json(&value.to_string()).is_err(), "{part}");
    }
    Ok(())
}

#[test]
fn every_setting_is_changed_by_its_name() -> Result {
    for settings in small() {
        // By way of text, in which an `f32` has its own digits.
        let value: Value = serde_json::from_str(&serde_json::to_string(&settings)?)?;
        for (name, value) in named(&value) {
            assert_eq!(settings.with(&format!("{name}={value}"))?, settings, "{name}");
        }
        let mut changed = settings.with("gamma=0.5")?.with("left_out=[3]")?;
        if !matches!(settings.algorithm, AlgorithmSettings::Ppo(_)) {
            changed = changed.with("goal_strategy=final")?;
        }
        assert_ne!(changed, settings);
        assert_eq!(TrainSettings::from_json(&serde_json::to_string(&changed)?)?, changed);
        for (wrong, expected) in [
            ("gama=0.9", "there is no setting gama; did you mean gamma?"),
            ("gamma", "write KEY=VALUE"),
            ("gamma=much", "\"much\" is not a value of gamma: "),
            ("hidden=[256,", "[256, is not a number"),
            ("goal_strategy=past", "\"past\" is not a value of goal_strategy: unknown variant"),
            ("hidden=0.5", "0.5 is not a value of hidden: "),
            ("gamma=2", "gamma is 2.0: choose from 0.0 to 1.0"),
        ] {
            let error = settings.with(wrong).expect_err(wrong).to_string();
            assert!(error.starts_with(expected), "{error}");
        }
    }
    for preset in Preset::ALL {
        assert_eq!(preset.name().parse::<Preset>()?, preset);
        preset.settings(Task::Push).check()?;
    }
    let error = "fats".parse::<Preset>().expect_err("no preset").to_string();
    let expected = "there is no preset fats; did you mean fast? All are: authors, book, book-ppo, \
                    fast, fast-ppo";
    assert_eq!(error, expected);
    Ok(())
}
