//! Stepping all environments together gives the results of single ones.

use fetch_env::{
    FetchResetOptions,
    vec_env::{AutoresetMode, VecConfig, VecEnv, VecReset},
};
use fetch_sim::{SimConfig, Simulator};

use crate::common::{MODES, Result, actions, envs, kinematic, row_of, rows, singles, vec_env};

/// Compares twenty steps of nine environments row by row.
fn equal_to_singles<S: Simulator + Send + 'static>(
    simulator: impl Fn(&SimConfig) -> S + Copy,
) -> Result {
    const COUNT: usize = 9;
    for mode in MODES {
        for threads in [1, 2, 3, 8] {
            let config = VecConfig::default().with_num_threads(threads).with_autoreset(mode);
            let mut together = VecEnv::new(envs(COUNT, simulator)?, config)?;
            let mut singles = singles(COUNT, mode, simulator)?;
            let expected: Vec<_> = (100..)
                .zip(&mut singles)
                .map(|(seed, env)| env.reset(Some(seed)))
                .collect::<Result<_, _>>()?;
            assert_eq!(rows(together.reset(Some(100))?), expected);
            for step in 0..20 {
                let mask: Vec<bool> = singles.iter().map(|env| env.needs_reset()).collect();
                if mask.contains(&true) {
                    for env in singles.iter_mut().filter(|env| env.needs_reset()) {
                        env.reset(None)?;
                    }
                    let reset = VecReset { mask: Some(&mask), ..VecReset::default() };
                    together.reset_with(&reset)?;
                }
                let expected: Vec<_> = (0..)
                    .zip(&mut singles)
                    .map(|(id, env)| env.step(id))
                    .collect::<Result<_, _>>()?;
                // The actions depend on the number of calls, as those of the single environments
                // do.
                let batch = together.step(&actions(COUNT, step))?;
                assert_eq!(rows(batch), expected, "{mode:?}, {threads} threads, step {step}");
            }
        }
    }
    Ok(())
}

#[test]
fn a_batch_has_the_bits_of_single_environments() -> Result {
    equal_to_singles(kinematic)
}

#[cfg(feature = "mujoco")]
#[test]
fn a_batch_has_the_bits_of_single_environments_on_mujoco() -> Result {
    use fetch_sim::{FetchModel, MujocoSimulator, Task};

    let model = FetchModel::load(&SimConfig::new(Task::Push))?;
    let model = &model;
    equal_to_singles(|_| MujocoSimulator::from_model(model.clone()).expect("memory"))
}

#[cfg(feature = "mujoco")]
#[test]
fn environments_made_by_name_share_a_model() -> Result {
    let envs = fetch_env::make_vec("FetchSlide-v4", 3, VecConfig::default())?;
    let model = |env_index| {
        let env = envs.env(env_index).expect("an idle environment");
        env.inner().simulator().fetch_model()
    };
    assert!(std::sync::Arc::ptr_eq(model(0), model(2)));
    let alone = fetch_env::make("FetchSlideDense-v4")?;
    assert!(std::sync::Arc::ptr_eq(model(0), alone.inner().simulator().fetch_model()));
    Ok(())
}

#[test]
fn a_masked_reset_leaves_the_other_rows_as_they_were() -> Result {
    for mode in MODES {
        let mut envs = vec_env(3, VecConfig::default().with_num_threads(2).with_autoreset(mode))?;
        envs.reset(Some(0))?;
        let before = rows(envs.step(&actions(3, 0))?);
        let options = vec![FetchResetOptions::default().with_desired_goal([1.3, 0.7, 0.5]); 3];
        let seeds = [Some(9), Some(7), None];
        let mask = [false, true, false];
        let reset = VecReset { seeds: Some(&seeds), mask: Some(&mask), options: Some(&options) };
        let batch = envs.reset_with(&reset)?;
        assert_eq!(row_of(batch, 0), before[0]);
        assert_eq!(row_of(batch, 2), before[2]);
        assert_eq!(batch.desired_goal()[3..6], [1.3, 0.7, 0.5]);
        assert_eq!(batch.reward()[1], 0.0);
        let seed = envs.env(1).ok_or("in flight")?.inner().np_random_seed();
        assert_eq!(seed, Some(7));
    }
    Ok(())
}

#[test]
fn the_next_step_ignores_the_action_and_same_step_keeps_the_end() -> Result {
    for mode in [AutoresetMode::NextStep, AutoresetMode::SameStep] {
        let mut envs = vec_env(1, VecConfig::default().with_autoreset(mode))?;
        envs.reset(Some(0))?;
        for step in 0..4 {
            envs.step(&actions(1, step))?;
        }
        let last = envs.step(&actions(1, 4))?;
        assert!(last.truncated()[0] && !last.terminated()[0]);
        let same_step = mode == AutoresetMode::SameStep;
        assert_eq!(last.final_info()[0].is_some(), same_step);
        assert_eq!((last.stepped(), last.started()), (&[true][..], &[same_step][..]));
        if let Some(end) = last.final_info()[0] {
            assert_ne!(last.next_observation(), last.observation());
            assert_eq!(last.reward()[0], -end.distance, "the reward is the last step's");
        } else {
            let goal = last.desired_goal().to_vec();
            let next = envs.step(&[f32::NAN; 4])?;
            assert_eq!(next.errors().count(), 0);
            assert_eq!((next.reward()[0], next.truncated()[0]), (0.0, false));
            assert_ne!(next.desired_goal(), goal);
            assert_eq!((next.stepped(), next.started()), (&[false][..], &[true][..]));
        }
    }
    Ok(())
}
