use fetch_env::{Env, EnvError, EnvId, FetchConfig, SnapshotEnv};
use fetch_sim::Task;

use super::{Backend, bits, make, make_config, random_steps, trajectory_bits};

pub(crate) fn snapshots_survive_json_to_the_last_bit<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        env.reset(Some(21)).expect("a reset");
        random_steps::<B>(&mut env, 21, 13);
        let json = serde_json::to_string(&env.snapshot()).expect("serializable");
        let snapshot = serde_json::from_str(&json).expect("deserializable");
        assert_eq!(env.snapshot(), snapshot, "{id}");
        let mut other = make::<B>(id);
        other.restore(&snapshot).expect("a snapshot of this environment");
        assert_eq!(
            trajectory_bits(&random_steps::<B>(&mut env, 22, 120)),
            trajectory_bits(&random_steps::<B>(&mut other, 22, 120)),
            "{id}"
        );
    }
}

pub(crate) fn foreign_snapshots_are_refused_and_change_nothing<B: Backend>() {
    let sparse = |task| FetchConfig::builder(task);
    for task in Task::ALL {
        let mut env = make_config::<B>(sparse(task).build().expect("the default"));
        env.reset(Some(23)).expect("a reset");
        random_steps::<B>(&mut env, 23, 30);
        let before = env.snapshot();

        let others = Task::ALL.into_iter().filter(|&other| other != task).map(sparse);
        let longer = sparse(task).max_episode_steps(200);
        for other in others.chain([sparse(task).n_substeps(10), longer]) {
            let config = other.build().expect("valid numbers");
            let mut other = make_config::<B>(config.clone());
            other.reset(Some(23)).expect("a reset");
            for _ in 0..60.min(config.max_episode_steps().get() - 1) {
                other.step(&[0.1; 4]).expect("a step");
            }
            let refusal = env.restore(&other.snapshot());
            assert!(
                matches!(refusal, Err(EnvError::ForeignSnapshot { .. })),
                "{task} took a snapshot of {config:?}: {refusal:?}"
            );
            assert_eq!(env.snapshot(), before, "{task}");
        }
    }
}

pub(crate) fn a_restored_environment_observes_what_it_did<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        assert_eq!(env.inner().observe(), Err(EnvError::ResetNeeded));
        env.reset(Some(24)).expect("a reset");
        let seen = random_steps::<B>(&mut env, 24, 9)[8].observation;
        let snapshot = env.snapshot();
        random_steps::<B>(&mut env, 25, 9);
        env.restore(&snapshot).expect("its own snapshot");
        let observed = env.inner().observe().expect("a running episode");
        assert_eq!(bits(&observed), bits(&seen), "{id}");
    }
}
