//! Laws of starts that options set: the gripper elsewhere, the object turned, raised or held.

use fetch_env::{Env, EnvError, EnvId, FetchResetOptions, GoalObservation, StartError, Task};
use fetch_sim::{SimError, Simulator};
use nalgebra::Vector3;

use super::{Backend, Result, bits, make};

fn distance(from: [f64; 3], to: [f64; 3]) -> f64 {
    from.iter().zip(&to).map(|(from, to)| (from - to).powi(2)).sum::<f64>().sqrt()
}

fn with_objects() -> impl Iterator<Item = EnvId> {
    EnvId::ALL.into_iter().filter(|id| id.task.has_object())
}

pub(crate) fn the_gripper_starts_where_the_option_says_and_nothing_else_changes<B: Backend>()
-> Result {
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        let plain = env.reset(Some(3))?.observation;
        let next = env.reset(None)?.observation;
        let settled = env.inner().simulator().settled().gripper_position;
        for way in [[-0.14, -0.15, 0.1], [0.12, 0.15, 0.02], [0.0, 0.1, 0.05]] {
            let place = (settled + Vector3::from(way)).into();
            let options = FetchResetOptions::default().with_gripper_position(place);
            let start = env.reset_with(Some(3), &options)?.observation;
            assert!(distance(start.grip_position(), place) < 1e-3, "{id}: {start:?}");
            assert!(
                start.grip_velocity().iter().all(|speed| speed.abs() < 1e-3),
                "{id}: {start:?}"
            );
            assert_eq!(start.desired_goal(), plain.desired_goal(), "{id}");
            if let (Some(before), Some(after)) = (plain.object_position(), start.object_position())
            {
                assert!(distance(before, after) < 1e-3, "{id}: {before:?}, {after:?}");
            }
            let after = env.reset(None)?.observation;
            assert_eq!(bits(&after), bits(&next), "{id}: the random numbers were disturbed");
        }
    }
    Ok(())
}

pub(crate) fn the_object_lies_as_the_options_say<B: Backend>() -> Result {
    for id in with_objects() {
        let mut env = make::<B>(id)?;
        let raised =
            FetchResetOptions::default().with_object_position([1.25, 0.9]).with_object_height(0.6);
        let start = env.reset_with(Some(0), &raised)?.observation;
        let place = start.object_position().ok_or("no object")?;
        assert!(distance(place, [1.25, 0.9, 0.6]) < 1e-3, "{id}: {place:?}");
        let fallen = env.step(&[0.0; 4])?.observation.object_position().ok_or("no object")?;
        assert!(fallen[2] < 0.6, "{id}: {fallen:?} has not begun to fall");

        let angle = 0.7_f64;
        let quarter = [2.0 * (angle / 2.0).cos(), 0.0, 0.0, 2.0 * (angle / 2.0).sin()];
        let turned = FetchResetOptions::default().with_object_rotation(quarter);
        let start = env.reset_with(Some(0), &turned);
        if B::OBJECT_TURNS {
            let yaw = start?.observation.observation()[13];
            assert!((yaw - angle).abs() < 1e-3, "{id}: {yaw}");
        } else {
            let refusal = start.expect_err("an object that does not turn");
            assert!(matches!(refusal.downcast_ref(), Some(SimError::CannotVary { .. })), "{id}");
        }
    }
    Ok(())
}

pub(crate) fn a_held_object_stays_in_the_hand_and_is_lifted<B: Backend>() -> Result {
    for id in with_objects().filter(|id| id.task == Task::PickAndPlace) {
        let mut env = make::<B>(id)?;
        for place in [None, Some([1.45, 0.6, 0.7]), Some([1.3, 0.8, 0.43])] {
            let mut options = FetchResetOptions::default().with_object_in_gripper(true);
            if let Some(place) = place {
                options = options.with_gripper_position(place);
            }
            let start = env.reset_with(Some(0), &options)?.observation;
            for _ in 0..10 {
                let step = env.step(&[0.0, 0.0, 0.5, -1.0])?.observation;
                let object = step.object_position().ok_or("no object")?;
                let slip = distance(object, step.grip_position());
                assert!(slip < 0.02, "{id}, {place:?}: it slipped by {slip} m");
            }
            let lifted = env.step(&[0.0; 4])?.observation.object_position().ok_or("no object")?;
            let from = start.object_position().ok_or("no object")?;
            assert!(lifted[2] > from[2] + 0.1, "{id}, {place:?}: {from:?} to {lifted:?}");
        }
    }
    Ok(())
}

pub(crate) fn impossible_starts_are_refused<B: Backend>() -> Result {
    let held = FetchResetOptions::default().with_object_in_gripper(true);
    for id in EnvId::ALL {
        let mut env = make::<B>(id)?;
        env.reset(Some(0))?;
        let mut refused = |options: &FetchResetOptions| {
            let refusal = env.reset_with(Some(0), options).expect_err("a refusal");
            let steps_on = env.step(&[0.0; 4]).is_ok();
            (refusal, steps_on)
        };
        let far = FetchResetOptions::default().with_gripper_position([3.0, 0.75, 0.5]);
        let (refusal, steps_on) = refused(&far);
        let out_of_reach = matches!(refusal.downcast_ref(), Some(StartError::OutOfReach { .. }));
        assert!(out_of_reach && !steps_on, "{id}: {refusal}");
        if !id.task.has_object() {
            let (refusal, _) = refused(&held);
            assert_eq!(refusal, SimError::NoObject { task: id.task }.into(), "{id}");
        } else if id.task.block_gripper() {
            let (refusal, _) = refused(&held);
            assert!(matches!(refusal, EnvError::OptionUnfit { .. }), "{id}: {refusal}");
        } else {
            let (refusal, _) = refused(&held.clone().with_object_height(0.5));
            assert!(matches!(refusal, EnvError::OptionUnfit { .. }), "{id}: {refusal}");
        }
        env.reset(Some(0))?;
        let nowhere = FetchResetOptions::default().with_object_rotation([0.0; 4]);
        assert!(env.reset_with(Some(0), &nowhere).is_err(), "{id}");
        env.step(&[0.0; 4]).map_err(|error| format!("{id}: a refusal changed it: {error}"))?;
    }
    Ok(())
}
