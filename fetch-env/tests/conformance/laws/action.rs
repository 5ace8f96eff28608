//! Laws of actions: clipping, and what each element does.

use fetch_env::{Env, EnvError, EnvId, GoalObservation};

use super::{Backend, Result, bits, make};

pub(crate) fn actions_are_clipped_to_the_action_space<B: Backend>() -> Result {
    for id in EnvId::ALL {
        for (wild, clipped) in [
            ([7.0, -3.0, 1.0 + f32::EPSILON, 2.0], [1.0, -1.0, 1.0, 1.0]),
            ([-f32::MAX, f32::MAX, -0.5, -9.0], [-1.0, 1.0, -0.5, -1.0]),
        ] {
            let after = |action: [f32; 4]| -> Result<_, EnvError> {
                let mut env = make::<B>(id)?;
                env.reset(Some(1))?;
                Ok(bits(&env.step(&action)?.observation))
            };
            assert_eq!(after(wild)?, after(clipped)?, "{id}");
        }
    }
    Ok(())
}

pub(crate) fn the_fourth_element_moves_the_fingers_where_they_are_free<B: Backend>() -> Result {
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        env.reset(Some(1))?;
        for _ in 0..5 {
            env.step(&[0.0, 0.0, 0.0, 1.0])?;
        }
        let opened = env.step(&[0.0, 0.0, 0.0, 1.0])?.observation;
        if id.task.block_gripper() {
            assert_eq!(opened.finger_positions(), [0.0; 2], "{id}");
            continue;
        }
        // A positive action opens, contrary to the chapter's table.
        assert!(opened.finger_positions().iter().all(|&q| q > 0.045), "{id}: {opened:?}");
        for _ in 0..5 {
            env.step(&[0.0, 0.0, 0.0, -1.0])?;
        }
        let closed = env.step(&[0.0, 0.0, 0.0, -1.0])?.observation;
        assert!(closed.finger_positions().iter().all(|&q| q < 0.005), "{id}: {closed:?}");
    }
    Ok(())
}

pub(crate) fn each_axis_moves_the_gripper_its_way<B: Backend>() -> Result {
    for id in EnvId::ALL {
        for axis in 0..3 {
            // Upwards only, because in three of the tasks the table is just below.
            for sign in [1.0, -1.0].into_iter().take(if axis == 2 { 1 } else { 2 }) {
                let mut env = make::<B>(id)?;
                let start = env.reset(Some(1))?.observation;
                let mut action = [0.0; 4];
                action[axis] = sign;
                let step = env.step(&action)?;
                let end = env.step(&action)?.observation;
                let before = start.grip_position()[axis];
                let moved = f64::from(sign) * (end.grip_position()[axis] - before);
                assert!(moved > 0.005, "{id}: axis {axis}, sign {sign} moved {moved} m");
                assert!(moved < 0.11, "{id}: two steps moved {moved} m");
                assert_eq!(step.observation.desired_goal(), start.desired_goal(), "{id}");
            }
        }
    }
    Ok(())
}
