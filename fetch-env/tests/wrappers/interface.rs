//! What lies between a policy and the robot: scale, low pass, noise and delay.

use fetch_env::{
    Env, EnvError, EnvExt, GoalObservation, SnapshotEnv,
    wrappers::{
        ActionNoise, DelayAction, DelayObservation, LowPassAction, ObservationNoise, ScaleAction,
    },
};

use super::{Result, push};

const ACTION: [f32; 4] = [0.5, -0.25, 0.75, 1.0];

#[test]
fn neutral_settings_change_no_bit() -> Result {
    let env = push()?.wrap(DelayAction::new(0))?.wrap(ActionNoise::new(0.0, 1))?;
    let env = env.wrap(ScaleAction::new(1.0))?.wrap(LowPassAction::new(1.0))?;
    let mut env = env.wrap(ObservationNoise::new(0.0, 2))?.wrap(DelayObservation::new(0))?;
    let mut plain = push()?;
    for seed in 0..2 {
        let (wrapped, bare) = (env.reset(Some(seed))?, plain.reset(Some(seed))?);
        assert_eq!(wrapped.observation.observation(), bare.observation.observation());
        for at in 0..50 {
            // Beyond the bounds, too, which the environment clips to.
            let action = ACTION.map(|element| element * (at as f32 - 25.0) * 0.1);
            let (wrapped, bare) = (env.step(&action)?, plain.step(&action)?);
            assert_eq!(wrapped.observation.observation(), bare.observation.observation());
            assert_eq!(wrapped.reward.to_bits(), bare.reward.to_bits());
        }
    }
    Ok(())
}

#[test]
fn the_same_seed_gives_the_same_noise_and_another_one_other_noise() -> Result {
    let noise = |own: u64, seed: u64| {
        let mut env = push()?.wrap(ObservationNoise::new(0.1, own))?;
        let mut errors = Vec::new();
        for _ in 0..2 {
            errors.clear();
            let first = env.reset(Some(seed))?.observation;
            let exact = first.original().observation();
            errors
                .extend(first.observation().iter().zip(exact).map(|(noisy, exact)| noisy - exact));
        }
        Ok::<_, EnvError>(errors)
    };
    assert_eq!(noise(1, 5)?, noise(1, 5)?);
    for (own, seed) in [(1, 6), (2, 5), (5, 1)] {
        let (these, others) = (noise(1, 5)?, noise(own, seed)?);
        assert!(these.iter().zip(&others).all(|(this, other)| this != other), "{own} {seed}");
    }
    Ok(())
}

#[test]
fn noise_has_its_standard_deviation_and_leaves_goals_exact() -> Result {
    let mut env = push()?.wrap(ObservationNoise::new(0.5, 7).with_elements([0, 24]))?;
    let mut errors = Vec::new();
    let mut seen = env.reset(Some(0))?.observation;
    for step in 0..2_000 {
        let exact = seen.original();
        assert_eq!(seen.desired_goal(), exact.desired_goal());
        assert_eq!(seen.achieved_goal(), exact.achieved_goal());
        assert_eq!(seen.observation()[1..24], exact.observation()[1..24]);
        errors.extend([0, 24].map(|at| seen.observation()[at] - exact.observation()[at]));
        seen = if step % 50 == 49 {
            env.reset(None)?.observation
        } else {
            env.step(&ACTION)?.observation
        };
    }
    let count = errors.len() as f64;
    let mean = errors.iter().sum::<f64>() / count;
    let variance = errors.iter().map(|error| error * error).sum::<f64>() / count;
    // Five standard errors of 4,000 numbers.
    assert!(mean.abs() < 5.0 * 0.5 / count.sqrt(), "{mean}");
    assert!((variance / 0.25 - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "{variance}");
    Ok(())
}

#[test]
fn delayed_observations_and_actions_are_those_of_some_steps_ago() -> Result {
    let mut env = push()?.wrap(DelayAction::new(2))?.wrap(DelayObservation::new(3))?;
    let mut plain = push()?;
    let mut past = vec![plain.reset(Some(3))?.observation.observation().to_vec(); 4];
    assert_eq!(env.reset(Some(3))?.observation.observation(), past[0]);
    let actions: Vec<[f32; 4]> = (0..10).map(|at| ACTION.map(|x| x * 0.1 * at as f32)).collect();
    for at in 0..actions.len() {
        let late = if at < 2 { [0.0; 4] } else { actions[at - 2] };
        let step = plain.step(&late)?;
        past.push(step.observation.observation().to_vec());
        let seen = env.step(&actions[at])?.observation;
        assert_eq!(seen.observation(), past[past.len() - 4]);
        assert_eq!(seen.achieved_goal(), step.observation.achieved_goal());
    }
    Ok(())
}

#[test]
fn a_refused_step_changes_nothing() -> Result {
    let env = push()?.wrap(DelayAction::new(1))?.wrap(ActionNoise::new(0.1, 1))?;
    let mut env = env.wrap(LowPassAction::new(0.5))?;
    env.reset(Some(0))?;
    for _ in 0..50 {
        let before = env.snapshot();
        assert!(env.step(&[f32::NAN; 4]).is_err());
        assert!(env.step(&[0.0; 3]).is_err());
        assert_eq!(env.snapshot(), before);
        env.step(&ACTION)?;
    }
    let before = env.snapshot();
    assert_eq!(env.step(&ACTION).map(drop), Err(EnvError::EpisodeOver));
    assert_eq!(env.snapshot(), before);
    Ok(())
}

#[test]
fn settings_out_of_range_are_refused() -> Result {
    let outside =
        |name, value, least, most| Err(EnvError::SettingOutside { name, value, least, most });
    for value in [-0.1, 100.1, f64::INFINITY] {
        let refusal = push()?.wrap(ScaleAction::new(value)).map(drop);
        assert_eq!(refusal, outside("factor", value, 0.0, 100.0));
        let refusal = push()?.wrap(ActionNoise::new(value, 0)).map(drop);
        assert_eq!(refusal, outside("standard_deviation", value, 0.0, 100.0));
        let refusal = push()?.wrap(ObservationNoise::new(value, 0)).map(drop);
        assert_eq!(refusal, outside("standard_deviation", value, 0.0, 100.0));
        let refusal = push()?.wrap(LowPassAction::new(value)).map(drop);
        assert_eq!(refusal, outside("share", value, 0.001, 1.0));
    }
    assert!(push()?.wrap(ScaleAction::new(f64::NAN)).is_err());
    assert!(push()?.wrap(ObservationNoise::new(0.1, 0).with_elements([25])).is_err());
    Ok(())
}
