//! Laws of worlds that vary.

use fetch_env::check::{CheckOptions, check_goal_env};
use fetch_env::variation::{Draw, LookFactor, PhysicsFactor, Variation, VariationError};
use fetch_env::vec_env::{VecConfig, VecReset};
use fetch_env::{
    Env, EnvError, EnvId, FetchConfig, FetchResetOptions, GoalObservation, MakeError, SnapshotEnv,
    VecEnv,
};
use fetch_sim::{SimError, Simulator};

use super::{
    Backend, FetchStep, Result, TestEnv, bits, make, make_with_config, random_steps,
    trajectory_bits,
};

/// Returns an environment's settings with everything varied that the simulator can vary.
fn varied<B: Backend>(id: EnvId) -> Result<FetchConfig> {
    let simulator = B::simulator(id.config().sim())?;
    let mut variation = Variation::default()
        .with("action_delay", Draw::Choice(vec![0.0, 2.0]))?
        .with("observation_delay", Draw::Choice(vec![0.0, 1.0]))?
        .with("grip_velp_noise", 0.01)?
        .with("achieved_goal_noise", 0.001)?;
    for &factor in PhysicsFactor::ALL {
        if simulator.can_vary(factor).is_ok() {
            let draw = match factor {
                PhysicsFactor::ObjectSize => Draw::Uniform(0.9, 1.1),
                PhysicsFactor::Gravity => Draw::Uniform(8.0, 11.0),
                PhysicsFactor::ObjectSpinFriction => Draw::Fixed(0.01),
                _ => Draw::LogUniform(0.5, 2.0),
            };
            variation = variation.with(factor, draw)?;
        }
    }
    Ok(id.config().with_variation(with_looks(variation, id)?))
}

/// Varies all looks that an environment has.
fn with_looks(variation: Variation, id: EnvId) -> Result<Variation, VariationError> {
    let looks = LookFactor::ALL.iter().filter(|factor| {
        id.config().task().has_object() || !LookFactor::OBJECT_COLOR.contains(factor)
    });
    let mut looks = looks.map(|&factor| (factor, factor.bounds()));
    looks.try_fold(variation, |variation, (factor, [least, most])| {
        variation.with(factor, least..=most)
    })
}

fn make_varied<B: Backend>(id: EnvId) -> Result<TestEnv<B>> {
    Ok(make_with_config::<B>(varied::<B>(id)?)?)
}

pub(crate) fn a_varied_environment_passes_every_check<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let make = || make_varied::<B>(id).map_err(|error| EnvError::other(error.to_string()));
        let options = CheckOptions::default();
        let report = check_goal_env(make, &options);
        assert!(report.passed(), "{id}:\n{report}");
    }
    Ok(())
}

pub(crate) fn objects_and_goals_start_where_they_do_without_a_variation<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let (mut plain, mut varied) = (make::<B>(id)?, make_varied::<B>(id)?);
        let mut seen = Vec::new();
        for episode in 0..20 {
            let seed = (episode % 7 == 0).then_some(episode);
            let plain = plain.reset(seed)?.observation;
            let start = varied.reset(seed)?.observation;
            assert_eq!(plain.desired_goal(), start.desired_goal(), "{id}");
            let across = |position: Option<[f64; 3]>| position.map(|[x, y, _]| [x, y]);
            assert_eq!(across(plain.object_position()), across(start.object_position()), "{id}");
            let numbers: Vec<_> = varied.inner().variation().iter().map(|(_, n)| n).collect();
            assert!(!seen.contains(&numbers), "{id} has drawn {numbers:?} twice");
            seen.push(numbers);
        }
    }
    Ok(())
}

pub(crate) fn no_number_is_drawn_twice<B: Backend>() -> Result {
    let names = ["gravity", "friction", "action_scale", "action_noise", "observation_noise"];
    for id in EnvId::ALL {
        let draws = names
            .into_iter()
            .try_fold(Variation::default(), |variation, name| variation.with(name, 0.2..=0.9));
        let mut env = make_with_config::<B>(id.config().with_variation(draws?))?;
        let mut drawn = Vec::new();
        for episode in 0..40 {
            env.reset((episode == 0).then_some(9))?;
            drawn.extend(env.inner().variation().iter().map(|(_, number)| number));
        }
        drawn.sort_by(f64::total_cmp);
        drawn.dedup();
        assert_eq!(drawn.len(), 40 * names.len(), "{id}");
    }
    Ok(())
}

pub(crate) fn a_seed_gives_the_same_numbers_and_steps_again<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let run = |before: u64| -> Result<_> {
            let mut env = make_varied::<B>(id)?;
            env.reset(Some(before))?;
            random_steps::<B>(&mut env, before, 10)?;
            env.reset(Some(4))?;
            Ok(trajectory_bits(&random_steps::<B>(&mut env, 5, 120)?))
        };
        assert_eq!(run(1)?, run(2)?, "{id}");
    }
    Ok(())
}

pub(crate) fn a_snapshot_holds_the_numbers<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let mut env = make_varied::<B>(id)?;
        env.reset(Some(31))?;
        random_steps::<B>(&mut env, 31, 13)?;
        let snapshot = serde_json::from_str(&serde_json::to_string(&env.snapshot())?)?;
        // Also into an environment without a variation, whose next episode has the model's numbers.
        let (mut other, mut plain) = (make_varied::<B>(id)?, make::<B>(id)?);
        let rest = |env: &mut TestEnv<B>| -> Result<Vec<FetchStep>> {
            env.restore(&snapshot)?;
            Ok(random_steps::<B>(env, 32, 37)?)
        };
        let expected = trajectory_bits(&rest(&mut env)?);
        other.reset(Some(1))?;
        assert_eq!(trajectory_bits(&rest(&mut other)?), expected, "{id}");
        let steps = rest(&mut plain)?;
        assert_eq!(trajectory_bits(&steps)[..36], expected[..36], "{id}");
        assert_eq!(plain.inner().variation().iter().count(), 0, "{id}");
    }
    Ok(())
}

pub(crate) fn looks_change_no_step<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let looks = with_looks(Variation::default(), id)?;
        let mut varied = make_with_config::<B>(id.config().with_variation(looks))?;
        let run = |env: &mut TestEnv<B>| -> Result<_> {
            env.reset(Some(6))?;
            Ok(trajectory_bits(&random_steps::<B>(env, 6, 120)?))
        };
        assert_eq!(run(&mut varied)?, run(&mut make::<B>(id)?)?, "{id}");
        assert!(varied.inner().variation().get("table_color_red").is_some());
    }
    Ok(())
}

pub(crate) fn options_set_a_number_for_one_episode<B: Backend>() -> Result {
    let id: EnvId = "FetchPush-v4".parse()?;
    let options = FetchResetOptions::default().with_factor("gravity", 3.5);
    for mut env in [make::<B>(id)?, make_varied::<B>(id)?] {
        env.reset_with(Some(3), &options)?;
        assert_eq!(env.inner().variation().get("gravity"), Some(3.5));
        assert_eq!(env.inner().simulator().physics().get(PhysicsFactor::Gravity), Some(3.5));
        env.reset(None)?;
        assert_ne!(env.inner().variation().get("gravity"), Some(3.5));
    }
    // What an option sets is drawn all the same, so that nothing else changes.
    let (mut free, mut fixed) = (make_varied::<B>(id)?, make_varied::<B>(id)?);
    free.reset(Some(3))?;
    fixed.reset_with(Some(3), &options)?;
    for (name, value) in free.inner().variation().iter().filter(|&(name, _)| name != "gravity") {
        assert_eq!(fixed.inner().variation().get(name), Some(value), "{name}");
    }
    let text = serde_json::to_string(&options)?;
    assert_eq!(serde_json::from_str::<FetchResetOptions>(&text)?, options);
    Ok(())
}

pub(crate) fn what_cannot_vary_is_refused<B: Backend>() -> Result {
    let reach: EnvId = "FetchReach-v4".parse()?;
    let mass = Variation::default().with("object_mass", 1.0)?;
    let refusal = make_with_config::<B>(reach.config().with_variation(mass));
    let refusal = refusal.err().ok_or("made")?;
    let expected = "object_mass cannot vary here, because ";
    assert!(refusal.to_string().starts_with(expected), "{refusal}");
    let refusal = refusal.downcast_ref::<MakeError>();
    let Some(MakeError::Variation(VariationError::Sim(SimError::CannotVary { .. }))) = refusal
    else {
        return Err(format!("{refusal:?}").into());
    };

    let mut env = make::<B>(reach)?;
    env.reset(Some(0))?;
    let before = env.snapshot();
    for (name, value, expected) in [
        ("object_mass", 1.0, "object_mass cannot vary here"),
        ("object_color_red", 1.0, "object_color_red cannot vary here, because the scene has no"),
        ("light_intensity", 1.5, "light_intensity is 1.5: pass numbers from 0 to 1"),
        ("gravity", f64::NAN, "gravity is NaN: pass numbers from 0 to 100"),
        ("gravity", -1.0, "gravity is -1.0: pass numbers from 0 to 100"),
        ("graviti", 1.0, r#"there is no factor "graviti": the nearest are gravity, "#),
        ("object_pos_noise", 0.1, "object_pos_noise cannot vary here"),
        ("action_delay", 51.0, "action_delay is 51.0: pass numbers from 0 to 50"),
    ] {
        let options = FetchResetOptions::default().with_factor(name, value);
        let refusal = env.reset_with(None, &options).err().ok_or(name)?.to_string();
        assert!(refusal.starts_with(expected), "{refusal}");
    }
    env.restore(&before)?;

    let with = |draw: Draw| Variation::default().with("gravity", draw).err();
    assert!(matches!(with(Draw::Uniform(2.0, 1.0)), Some(VariationError::Reversed { .. })));
    assert!(matches!(with(Draw::LogUniform(0.0, 1.0)), Some(VariationError::NoLogarithm { .. })));
    assert!(matches!(with(Draw::Choice(vec![])), Some(VariationError::NoChoice { .. })));
    let outside = with(Draw::Choice(vec![9.0, f64::INFINITY]));
    assert!(matches!(outside, Some(VariationError::OutOfRange { .. })));
    Ok(())
}

pub(crate) fn delayed_actions_come_late<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let (mut now, mut late) = (make::<B>(id)?, make::<B>(id)?);
        let options = FetchResetOptions::default().with_factor("action_delay", 3.0);
        now.reset(Some(8))?;
        late.reset_with(Some(8), &options)?;
        let actions: Vec<[f32; 4]> = (0..40_u8)
            .map(|step| [0, 1, 2, 3].map(|axis| f32::from(step + axis) % 5.0 / 2.0 - 1.0))
            .collect();
        let still = [[0.0; 4]; 3];
        let shifted = still.iter().chain(&actions);
        for (given, comes) in actions.iter().zip(shifted) {
            let (late, now) = (late.step(given)?.observation, now.step(comes)?.observation);
            assert_eq!(bits(&late), bits(&now), "{id}");
        }
    }
    Ok(())
}

pub(crate) fn any_number_of_threads_draws_the_same<B: Backend<Sim: Send + 'static>>() -> Result {
    let id: EnvId = "FetchPickAndPlace-v4".parse()?;
    let run = |num_threads| -> Result<Vec<u64>> {
        let envs = (0..5).map(|_| make_varied::<B>(id)).collect::<Result<Vec<_>>>()?;
        let mut envs = VecEnv::new(envs, VecConfig::default().with_num_threads(num_threads))?;
        let options: Vec<_> = (0..5)
            .map(|env| FetchResetOptions::default().with_factor("gravity", 9.0 + f64::from(env)))
            .collect();
        let seeds = [Some(1), Some(2), Some(3), Some(4), Some(5)];
        envs.reset_with(&VecReset {
            seeds: Some(&seeds),
            options: Some(&options),
            ..VecReset::default()
        })?;
        let mut bits = Vec::new();
        for step in 0..120_u8 {
            let action = f32::from(step % 7) / 3.0 - 1.0;
            let row = envs.step(&[action; 5 * 4])?;
            bits.extend(row.observation().iter().chain(row.reward()).map(|n| n.to_bits()));
        }
        Ok(bits)
    };
    let one = run(1)?;
    assert_eq!(one, run(2)?);
    assert_eq!(one, run(5)?);
    Ok(())
}
