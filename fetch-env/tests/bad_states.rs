//! Simulators in states that they cannot reach by themselves: read from a file, or driven there.

use fetch_sim::{Control, KinematicSimulator, SimConfig, Simulator, Task};
use nalgebra::Vector3;
use testing::Result;

#[test]
fn a_state_that_no_step_reaches_is_not_deserialized() -> Result {
    let mut push = KinematicSimulator::new(&SimConfig::new(Task::Push));
    push.step(&Control { displacement: Vector3::new(0.05, 0.0, 0.0), fingers: 0.0 })?;
    let json = serde_json::to_value(&push)?;
    assert_eq!(serde_json::from_value::<KinematicSimulator>(json.clone())?, push);
    for (path, number) in [
        ("/gripper/position/0", 1e308),
        ("/gripper/position/2", 0.40),
        ("/gripper/velocity/1", -1.1e10),
        ("/gripper/finger_positions/0", 0.06),
        ("/gripper/finger_velocities/1", 1e308),
        ("/object/position/0", 1e308),
        ("/object/velocity/1", -1e308),
        ("/object/motion/2", 1.1e10),
    ] {
        let mut changed = json.clone();
        *changed.pointer_mut(path).ok_or("no such number")? = number.into();
        let refused = serde_json::from_value::<KinematicSimulator>(changed);
        assert!(refused.is_err(), "{path} is {number}: {refused:?}");
    }
    for (path, value) in [("/object", None), ("/config/task", Some("reach"))] {
        let mut changed = json.clone();
        *changed.pointer_mut(path).ok_or("no such field")? = value.into();
        let refused = serde_json::from_value::<KinematicSimulator>(changed);
        assert!(refused.is_err(), "{path} is {value:?}: {refused:?}");
    }
    for n_substeps in [0, 1001, u32::MAX] {
        let mut changed = json.clone();
        changed["config"]["n_substeps"] = n_substeps.into();
        assert!(serde_json::from_value::<KinematicSimulator>(changed).is_err(), "{n_substeps}");
    }
    Ok(())
}

#[cfg(feature = "mujoco")]
mod mujoco {
    use fetch_env::{
        Env, EnvError, EnvId, FetchEnv, FetchObservation, GoalObservation, MujocoEnv, SnapshotEnv,
        check::same_bits,
    };
    use fetch_sim::{MujocoSimulator, SimError};
    use goal_reward::RewardKind;

    use super::*;

    const REACH: EnvId = EnvId { task: Task::Reach, reward: RewardKind::Sparse };
    /// The task whose gripper has actuators.
    const PICK_AND_PLACE: EnvId = EnvId { task: Task::PickAndPlace, reward: RewardKind::Sparse };

    /// Drives a simulator into a bad state.
    type Drive = fn(&mut MujocoSimulator);

    const DRIVES: [Drive; 3] = [
        |simulator| simulator.data_mut().qpos_mut()[0] = f64::NAN,
        |simulator| simulator.data_mut().ctrl_mut().fill(f64::NAN),
        |simulator| simulator.data_mut().qvel_mut()[0] = f64::INFINITY,
    ];

    fn environment(id: EnvId, drive: Drive) -> Result<MujocoEnv> {
        let config = id.config();
        let mut simulator = MujocoSimulator::new(config.sim())?;
        drive(&mut simulator);
        Ok(FetchEnv::new(config, simulator)?.time_limited())
    }

    fn same(a: &FetchObservation, b: &FetchObservation) -> bool {
        same_bits(a.observation(), b.observation())
    }

    #[test]
    fn a_reset_forgets_what_was_done_to_the_simulator() -> Result {
        for id in [REACH, PICK_AND_PLACE] {
            let mut untouched = environment(id, |_| ())?;
            for drive in DRIVES {
                let mut driven = environment(id, drive)?;
                let starts = [untouched.reset(Some(1))?, driven.reset(Some(1))?];
                assert!(same(&starts[0].observation, &starts[1].observation));
                for _ in 0..20 {
                    let steps = [untouched.step(&[0.2; 4])?, driven.step(&[0.2; 4])?];
                    assert!(same(&steps[0].observation, &steps[1].observation));
                }
            }
        }
        Ok(())
    }

    #[test]
    fn a_bad_state_is_not_restored() -> Result {
        for drive in DRIVES {
            let snapshot = environment(PICK_AND_PLACE, drive)?.snapshot();
            let mut env = environment(PICK_AND_PLACE, |_| ())?;
            env.reset(Some(2))?;
            let before = env.snapshot();
            let refusal = env.restore(&snapshot);
            assert!(matches!(refusal, Err(EnvError::ForeignSnapshot { .. })), "{refusal:?}");
            assert_eq!(env.snapshot(), before);
        }
        Ok(())
    }

    #[test]
    fn the_simulator_refuses_what_it_cannot_do_and_stays_as_it_was() -> Result {
        let mut simulator = MujocoSimulator::new(PICK_AND_PLACE.config().sim())?;
        simulator.reset(Some([1.3, 0.7]))?;
        let before = simulator.snapshot();
        for xy in [[f64::NAN, 0.7], [1.3, f64::NEG_INFINITY], [f64::MAX, 0.7], [1.3, -1.1e10]] {
            let refusal = simulator.reset(Some(xy));
            assert!(matches!(refusal, Err(SimError::OutOfRange { .. })), "{refusal:?}");
        }
        for (x, fingers) in [(f64::NAN, 0.0), (0.0, f64::NAN), (f64::INFINITY, 0.0)] {
            let control = Control { displacement: Vector3::new(x, 0.0, 0.0), fingers };
            let refusal = simulator.step(&control);
            assert!(matches!(refusal, Err(SimError::Unstable { .. })), "{refusal:?}");
        }
        assert_eq!(simulator.snapshot(), before);
        Ok(())
    }
}
