//! Environments whose physics fails.

use fetch_env::{Env, EnvError, EnvId, FetchEnv, SnapshotEnv};
use fetch_sim::SimError;
use testing::Faulty;
use testing::Result;

fn unstable() -> SimError {
    SimError::Unstable { reason: "the gripper went down".into() }
}

#[test]
fn a_failed_step_is_an_error_and_asks_for_a_reset() -> Result {
    for id in EnvId::ALL {
        let config = id.config();
        let simulator = Faulty::new(config.sim(), || Err(unstable()));
        let mut env = FetchEnv::new(config, simulator)?.time_limited();
        env.reset(Some(0))?;
        let good = env.snapshot();
        for recover in 0..2 {
            env.step(&[0.0; 4])?;
            let failure = env.step(&[0.0, 0.0, -1.0, 0.0]);
            assert_eq!(failure, Err(EnvError::from(unstable())), "{id}");
            for _ in 0..2 {
                assert_eq!(env.step(&[0.0; 4]), Err(EnvError::ResetNeeded), "{id}");
            }
            assert_eq!(env.inner().observe(), Err(EnvError::ResetNeeded), "{id}");
            if recover == 0 {
                env.restore(&good)?;
            } else {
                env.reset(None)?;
            }
            assert_eq!(env.elapsed_steps(), 0);
            env.step(&[0.0; 4])?;
        }
    }
    Ok(())
}
