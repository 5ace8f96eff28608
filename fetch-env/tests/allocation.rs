//! Steps and rewards allocate nothing, as a counting allocator sees it.

use allocation_counter::measure;
use fetch_env::{Env, EnvId, FetchEnv, GoalEnvExt, GoalObservation, variation::Variation};
use fetch_sim::{KinematicSimulator, SimConfig, SimError, Simulator};
use testing::Result;

fn is_free_of_allocation<S: Simulator>(
    simulator: impl Fn(&SimConfig) -> std::result::Result<S, SimError>,
) -> Result {
    for id in EnvId::ALL {
        let variation =
            Variation::default().with("observation_delay", 2.0)?.with("observation_noise", 0.1)?;
        let config = id.config().with_variation(variation);
        let simulator = simulator(config.sim())?;
        let mut env = FetchEnv::new(config, simulator)?.time_limited();
        let start = env.reset(Some(0))?.observation;
        let counted = measure(|| {
            for step in 0..50_u8 {
                let x = f32::from(step % 3) - 1.0;
                let step = env.step(&[x, -x, 0.5 * x, x]).expect("a step");
                let (achieved, desired) = (step.observation.achieved_goal(), start.desired_goal());
                assert_eq!(env.compute_reward(achieved, desired), Ok(step.reward));
            }
        });
        assert_eq!(counted.count_total, 0, "{id}: {counted:?}");
    }
    Ok(())
}

#[test]
fn nothing_is_allocated_on_the_kinematic_simulator() -> Result {
    is_free_of_allocation(|config| Ok(KinematicSimulator::new(config)))
}

#[cfg(feature = "mujoco")]
#[test]
fn nothing_is_allocated_on_mujoco() -> Result {
    is_free_of_allocation(fetch_sim::MujocoSimulator::new)
}

#[test]
fn the_counting_allocator_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0_u8; 10]))).count_total, 1);
}
