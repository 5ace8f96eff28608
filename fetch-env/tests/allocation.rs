//! A step and a reward allocate nothing, as a counting allocator sees it.

use allocation_counter::measure;
use fetch_env::{Env, EnvId, FetchEnv, GoalEnv, GoalObservation};
use fetch_sim::{KinematicSimulator, Simulator};

fn nothing_is_allocated<S: Simulator>(make: impl Fn(EnvId) -> FetchEnv<S>) {
    for id in EnvId::ALL {
        let mut env = make(id).time_limited();
        let start = env.reset(Some(0)).expect("a reset").observation;
        let counted = measure(|| {
            for step in 0..50_u8 {
                let x = f32::from(step % 3) - 1.0;
                let step = env.step(&[x, -x, 0.5 * x, x]).expect("a step");
                let (achieved, desired) = (step.observation.achieved_goal(), start.desired_goal());
                let reward = env.compute_reward(achieved, desired).expect("finite goals");
                assert_eq!(reward, step.reward);
            }
        });
        assert_eq!(counted.count_total, 0, "{id}: {counted:?}");
    }
}

#[test]
fn nothing_is_allocated_on_the_stand_in() {
    nothing_is_allocated(|id| {
        let config = id.config();
        let simulator = KinematicSimulator::new(config.sim());
        FetchEnv::new(config, simulator).expect("a fitting simulator")
    });
}

#[cfg(feature = "mujoco")]
#[test]
fn nothing_is_allocated_on_mujoco() {
    nothing_is_allocated(|id| {
        let config = id.config();
        let simulator = fetch_sim::MujocoSimulator::new(config.sim()).expect("MuJoCo");
        FetchEnv::new(config, simulator).expect("a fitting simulator")
    });
}

#[test]
fn the_counting_allocator_counts() {
    assert_eq!(measure(|| drop(std::hint::black_box(vec![0_u8; 10]))).count_total, 1);
}
