//! Laws of snapshots.

use fetch_env::{Env, EnvError, EnvId, FetchConfig, SnapshotEnv};
use fetch_sim::Task;
use goal_reward::RewardKind;
use testing::with_each_number_replaced;

use super::{Backend, Result, bits, make, make_with_config, random_steps, trajectory_bits};

pub(crate) fn snapshots_survive_json_to_the_last_bit<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        env.reset(Some(21))?;
        random_steps::<B>(&mut env, 21, 13)?;
        let json = serde_json::to_string(&env.snapshot())?;
        let snapshot = serde_json::from_str(&json)?;
        assert_eq!(env.snapshot(), snapshot, "{id}");
        let mut other = make::<B>(id)?;
        other.restore(&snapshot)?;
        assert_eq!(
            trajectory_bits(&random_steps::<B>(&mut env, 22, 120)?),
            trajectory_bits(&random_steps::<B>(&mut other, 22, 120)?),
            "{id}"
        );
    }
    Ok(())
}

pub(crate) fn foreign_snapshots_are_refused_and_change_nothing<B: Backend>() -> Result {
    let sparse = |task| FetchConfig::new(task, RewardKind::Sparse);
    for task in Task::ALL {
        let mut env = make_with_config::<B>(sparse(task))?;
        env.reset(Some(23))?;
        random_steps::<B>(&mut env, 23, 30)?;
        let before = env.snapshot();

        let others = Task::ALL.into_iter().filter(|&other| other != task).map(sparse);
        let longer = sparse(task).with_max_episode_steps(200)?;
        for config in others.chain([sparse(task).with_n_substeps(10)?, longer]) {
            let mut other = make_with_config::<B>(config.clone())?;
            other.reset(Some(23))?;
            for _ in 0..60.min(config.max_episode_steps().get() - 1) {
                other.step(&[0.1; 4])?;
            }
            let refusal = env.restore(&other.snapshot());
            assert!(
                matches!(refusal, Err(EnvError::ForeignSnapshot { .. })),
                "{task} took a snapshot of {config:?}: {refusal:?}"
            );
            assert_eq!(env.snapshot(), before, "{task}");
        }
    }
    Ok(())
}

pub(crate) fn a_restored_environment_observes_what_it_did<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        assert_eq!(env.inner().observe(), Err(EnvError::ResetNeeded));
        env.reset(Some(24))?;
        let seen = random_steps::<B>(&mut env, 24, 9)?.remove(8).observation;
        let snapshot = env.snapshot();
        random_steps::<B>(&mut env, 25, 9)?;
        env.restore(&snapshot)?;
        let observed = env.inner().observe()?;
        assert_eq!(bits(&observed), bits(&seen), "{id}");
    }
    Ok(())
}

pub(crate) fn numbers_that_no_state_can_have_are_refused_and_change_nothing<B: Backend>() -> Result
{
    const FRACTIONS: [f64; 5] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e308, -1.1e10];
    for task in Task::ALL {
        let id = EnvId { task, reward: RewardKind::Sparse };
        let [mut env, mut twin] = [make::<B>(id)?, make::<B>(id)?];
        for env in [&mut env, &mut twin] {
            env.reset(Some(25))?;
            random_steps::<B>(env, 25, 13)?;
        }
        let snapshot = env.snapshot();
        let restored = with_each_number_replaced(&snapshot, &FRACTIONS, &[])?;
        assert!(!restored.is_empty());
        for snapshot in &restored {
            let refusal = env.restore(snapshot);
            let is_foreign = matches!(refusal, Err(EnvError::ForeignSnapshot { .. }));
            assert!(is_foreign, "{id}: {refusal:?} of {snapshot:?}");
        }
        assert_eq!(
            trajectory_bits(&random_steps::<B>(&mut env, 26, 120)?),
            trajectory_bits(&random_steps::<B>(&mut twin, 26, 120)?),
            "{id}: a refused snapshot changed the environment"
        );

        // Numbers that a state can have are refused as well, or the environment works with them.
        let largest = [1e10, -1e10, 0.0];
        let counts = [0, u32::MAX.into(), u64::MAX];
        for snapshot in with_each_number_replaced(&snapshot, &largest, &counts)? {
            let before = env.snapshot();
            if let Err(refusal) = env.restore(&snapshot) {
                assert_eq!(env.snapshot(), before, "{id}: {refusal:?}");
                continue;
            }
            match random_steps::<B>(&mut env, 27, 3) {
                Ok(steps) => {
                    let mut numbers = steps.iter().flat_map(|step| bits(&step.observation));
                    assert!(numbers.all(|bits| f64::from_bits(bits).is_finite()), "{snapshot:?}");
                }
                Err(failure) => {
                    assert!(
                        failure.downcast_ref::<fetch_sim::SimError>().is_some(),
                        "{id}: {failure:?}"
                    )
                }
            }
            env.reset(None)?;
        }
    }
    Ok(())
}
