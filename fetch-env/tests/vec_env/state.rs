//! The state of environments in a vector: accessed, saved, restored, and begun as a function
//! chooses.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering::SeqCst},
};

use fetch_env::{
    Env, FetchResetOptions, SnapshotEnv, make_kinematic,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecEnvError, VecReset},
};

use crate::common::{MODES, Result, actions, rows, vec_env};

const COUNT: usize = 4;

fn config(mode: AutoresetMode) -> VecConfig {
    VecConfig::default().with_num_threads(2).with_autoreset(mode)
}

#[test]
fn a_restored_vector_continues_with_the_same_bits() -> Result {
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        // Step 5 ends the episodes of some environments, so that resets are due in one mode.
        for steps in [0, 3, 5, 11] {
            let mut envs = vec_env(COUNT, config(mode))?;
            envs.reset(Some(3))?;
            for step in 0..steps {
                envs.step(&actions(COUNT, step))?;
            }
            let snapshot = envs.snapshot()?;
            let json = serde_json::to_string(&snapshot)?;
            let mut continued = Vec::new();
            for step in steps..steps + 20 {
                continued.push(rows(envs.step(&actions(COUNT, step))?));
            }
            let mut other = vec_env(COUNT, VecConfig::default().with_autoreset(mode))?;
            other.restore(&serde_json::from_str::<Vec<_>>(&json)?)?;
            assert_eq!(other.snapshot()?, snapshot);
            for (step, expected) in (steps..).zip(&continued) {
                assert_eq!(rows(other.step(&actions(COUNT, step))?), *expected);
            }
        }
    }
    Ok(())
}

#[test]
fn a_restored_vector_shows_the_restored_states() -> Result {
    for mode in MODES {
        // The end of some episodes at step 5 shows the state at that end, or the next start.
        for steps in [0, 3, 5] {
            let mut envs = vec_env(COUNT, config(mode))?;
            let fresh = envs.snapshot()?;
            envs.reset(Some(3))?;
            for step in 0..steps {
                envs.step(&actions(COUNT, step))?;
            }
            let snapshot = envs.snapshot()?;
            let expected = envs.last_step().clone();
            let reset = VecReset { mask: Some(&[true, false, true, true]), ..VecReset::default() };
            let after_reset = envs.reset_with(&reset)?.clone();
            for step in 10..13 {
                envs.step(&actions(COUNT, step))?;
            }
            let other = vec_env(COUNT, VecConfig::default().with_autoreset(mode))?;
            for mut envs in [envs, other] {
                envs.restore(&snapshot)?;
                let shown = envs.last_step();
                assert_eq!(shown.env_index(), [0, 1, 2, 3]);
                assert_eq!(shown.observation_rows(), expected.observation_rows());
                assert_eq!(shown.next_observation_rows(), expected.observation_rows());
                assert_eq!((shown.started(), shown.stepped()), (&[true; 4][..], &[false; 4][..]));
                let again = envs.reset_with(&reset)?;
                assert_eq!(again.observation_rows(), after_reset.observation_rows());
                assert_eq!(again.started(), [true, false, true, true]);
                // Nothing is known of environments that have begun no episode.
                envs.restore(&fresh)?;
                assert!(envs.last_step().observation().iter().all(|number| number.is_nan()));
                assert_eq!(envs.last_step().started(), [false; 4]);
            }
        }
    }
    Ok(())
}

#[test]
fn a_foreign_snapshot_changes_no_environment() -> Result {
    let mut envs = vec_env(COUNT, config(AutoresetMode::NextStep))?;
    envs.reset(Some(0))?;
    let before = envs.snapshot()?;
    let fewer = vec_env(COUNT - 1, config(AutoresetMode::NextStep))?.snapshot()?;
    let count = VecEnvError::Count { what: "snapshot", actual: COUNT - 1, num_envs: COUNT };
    assert_eq!(envs.restore(&fewer), Err(count));

    // Two environments with different limits, 5 and 7 steps, are swapped, so their states do not
    // fit.
    let mut longer = vec_env(COUNT, config(AutoresetMode::NextStep))?;
    longer.reset(Some(1))?;
    for step in 0..6 {
        longer.step(&actions(COUNT, step))?;
    }
    let mut swapped = serde_json::to_value(longer.snapshot()?)?;
    swapped.as_array_mut().ok_or("an array")?.swap(2, 3);
    let error = envs.restore(&serde_json::from_value::<Vec<_>>(swapped)?);
    assert!(matches!(error, Err(VecEnvError::ForeignSnapshot { env_index: 2, .. })), "{error:?}");
    assert_eq!(envs.snapshot()?, before);

    envs.send(&actions(COUNT, 0), &[0, 1, 2, 3])?;
    assert_eq!(envs.snapshot(), Err(VecEnvError::InFlight { count: COUNT }));
    assert_eq!(envs.restore(&before), Err(VecEnvError::InFlight { count: COUNT }));
    Ok(())
}

#[test]
fn counts_that_no_program_reaches_are_not_restored() -> Result {
    let mut envs = vec_env(COUNT, config(AutoresetMode::NextStep))?;
    envs.reset(Some(0))?;
    let before = envs.snapshot()?;
    let mut late = serde_json::to_value(&before)?;
    for (num_episodes, is_refused) in
        [(u64::MAX, true), (u64::MAX / 2 + 1, true), (u64::MAX / 2, false)]
    {
        late[3]["wrapper"] = num_episodes.into();
        let restored = envs.restore(&serde_json::from_value::<Vec<_>>(late.clone())?);
        let foreign = matches!(restored, Err(VecEnvError::ForeignSnapshot { env_index: 3, .. }));
        assert_eq!((foreign, restored.is_err()), (is_refused, is_refused), "{restored:?}");
        assert_eq!(envs.snapshot()? == before, is_refused);
    }
    let mut drawn = serde_json::to_value(&before)?;
    drawn[0]["env"]["env"]["random"]["draws"] = u64::MAX.into();
    let refusal = serde_json::from_value::<Vec<_>>(drawn).map(|drawn| envs.restore(&drawn));
    assert!(refusal.is_err(), "{refusal:?}");
    Ok(())
}

#[test]
fn too_many_environments_are_refused_even_if_they_never_end() -> Result {
    let endless = std::iter::from_fn(|| make_kinematic("FetchReach-v4").ok());
    let refusal = VecEnv::new(endless, VecConfig::default()).err();
    assert_eq!(refusal, Some(VecEnvError::TooManyEnvs { most: 65_536 }));
    #[cfg(feature = "mujoco")]
    for num_envs in [65_537, 1_000_000_000_000, usize::MAX] {
        let refusal = fetch_env::make_vec("FetchReach-v4", num_envs, VecConfig::default()).err();
        let expected = VecEnvError::TooManyEnvs { most: 65_536 };
        assert_eq!(refusal, Some(fetch_env::MakeError::Vec(expected)));
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
#[test]
fn the_caller_stops_the_making_of_many_environments() {
    for num_threads in 1..=3 {
        let (mut asked, config) = (0, VecConfig::default().with_num_threads(num_threads));
        let stopped =
            fetch_env::make_vec_while("FetchReach-v4", 3_000, config, fetch_env::make, || {
                asked += 1;
                asked < 3
            });
        assert_eq!(stopped.err(), Some(fetch_env::MakeError::Stopped));
        assert_eq!(asked, 3);
    }
}

#[test]
fn more_threads_than_environments_are_not_started() -> Result {
    let mut envs = vec_env(3, VecConfig::default().with_num_threads(usize::MAX))?;
    assert_eq!(envs.num_threads(), 3);
    envs.reset(Some(0))?;
    Ok(())
}

#[test]
fn a_function_chooses_the_episodes_that_autoresets_begin() -> Result {
    let seed_of = |env_index: usize, episode: u64| 100 * env_index as u64 + episode;
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        let highest = Arc::new(AtomicU64::new(0));
        let mut envs = vec_env(COUNT, config(mode))?;
        let seen = Arc::clone(&highest);
        envs.set_autoreset_start(move |env_index, episode| {
            seen.fetch_max(episode, SeqCst);
            let goal = [1.3, 0.7, 0.42 + 0.01 * episode as f64];
            let options = FetchResetOptions::default().with_desired_goal(goal);
            (Some(seed_of(env_index, episode)), options)
        })?;
        envs.reset(Some(0))?;
        let mut episodes = [0; COUNT];
        for step in 0..30 {
            let batch = envs.step(&actions(COUNT, step))?;
            let started = batch.started().to_vec();
            let goals = batch.desired_goal().to_vec();
            for env_index in (0..COUNT).filter(|&env_index| started[env_index]) {
                episodes[env_index] += 1;
                let height = 0.42 + 0.01 * episodes[env_index] as f64;
                assert_eq!(goals[3 * env_index..][..3], [1.3, 0.7, height]);
                let seed = envs.env(env_index).ok_or("idle")?.inner().np_random_seed();
                assert_eq!(seed, Some(seed_of(env_index, episodes[env_index])));
            }
        }
        assert_eq!(episodes.into_iter().max(), Some(highest.load(SeqCst)));
        assert!(episodes.iter().all(|episodes| *episodes >= 3));
    }
    Ok(())
}

#[test]
fn each_environment_is_reset_with_its_own_options() -> Result {
    let goal = |env_index: usize| [1.3, 0.7, 0.5 + 0.01 * env_index as f64];
    let options: Vec<_> =
        (0..COUNT).map(|i| FetchResetOptions::default().with_desired_goal(goal(i))).collect();
    let reset = VecReset { options: Some(&options), ..VecReset::default() };
    let mut envs = vec_env(COUNT, config(AutoresetMode::Disabled))?;
    let goals = envs.reset_with(&reset)?.desired_goal().to_vec();
    assert_eq!(goals, (0..COUNT).map(goal).collect::<Vec<_>>().concat());
    let reset = VecReset { options: Some(&options[1..]), ..VecReset::default() };
    let count = VecEnvError::Count { what: "options", actual: COUNT - 1, num_envs: COUNT };
    assert_eq!(envs.reset_with(&reset).err(), Some(count));
    Ok(())
}

#[test]
fn an_idle_environment_can_be_changed() -> Result {
    for mode in MODES {
        let mut envs = vec_env(2, config(mode))?;
        envs.reset(Some(0))?;
        let state = envs.env(0).ok_or("idle")?.snapshot();
        let other = envs.env_mut(1).ok_or("idle")?;
        other.reset(Some(0))?;
        assert_eq!(other.snapshot(), state);
        let batch = envs.step(&[0.5; 8])?;
        assert_eq!(batch.desired_goal()[..3], batch.desired_goal()[3..]);
        assert_eq!(batch.observation()[..25], batch.observation()[25..]);
        envs.send(&[0.0; 4], &[1])?;
        assert!(envs.env_mut(1).is_none() && envs.env_mut(0).is_some());
        envs.recv(1)?;
    }
    Ok(())
}
