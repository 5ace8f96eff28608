//! What an environment does when the physics fails.

mod faulty;

use faulty::Faulty;
use fetch_env::{Env, EnvError, EnvId, FetchEnv, SnapshotEnv};
use fetch_sim::SimError;

fn unstable() -> SimError {
    SimError::Unstable { reason: "told to go down".into() }
}

#[test]
fn a_failed_step_is_an_error_and_asks_for_a_reset() {
    for id in EnvId::ALL {
        let config = id.config();
        let simulator = Faulty::new(config.sim(), || Err(unstable()));
        let mut env = FetchEnv::new(config, simulator).expect("it fits").time_limited();
        env.reset(Some(0)).expect("a reset");
        let good = env.snapshot();
        for recover in 0..2 {
            env.step(&[0.0; 4]).expect("a step");
            let failure = env.step(&[0.0, 0.0, -1.0, 0.0]);
            assert_eq!(failure, Err(EnvError::Sim(unstable())), "{id}");
            for _ in 0..2 {
                assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded), "{id}");
            }
            assert_eq!(env.inner().observe(), Err(EnvError::ResetNeeded), "{id}");
            if recover == 0 {
                env.restore(&good).expect("its own snapshot");
            } else {
                env.reset(None).expect("a reset");
            }
            assert_eq!(env.elapsed_steps(), 0);
            env.step(&[0.0; 4]).expect("a step");
        }
    }
}
