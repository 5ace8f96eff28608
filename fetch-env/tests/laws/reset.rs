use fetch_env::{Env, EnvError, EnvId, FetchResetOptions, GoalObservation};
use fetch_sim::SimError;

use super::{Backend, bits, make, random_steps, trajectory_bits};

const GOAL: [f64; 3] = [1.3, 0.7, 0.5];
const PLACE: [f64; 2] = [1.25, 0.85];

fn wishes(id: EnvId) -> FetchResetOptions {
    FetchResetOptions {
        desired_goal: Some(GOAL),
        object_position: id.task.has_object().then_some(PLACE),
    }
}

pub(crate) fn wished_goals_and_objects_are_granted<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        let start = env.reset_with(Some(0), &wishes(id)).expect("possible wishes").observation;
        assert_eq!(start.desired_goal(), GOAL, "{id}");
        if let Some([x, y, z]) = start.object_position() {
            // The object's site is not exactly at its body's origin on every simulator.
            assert!((x - PLACE[0]).abs() < 1e-3 && (y - PLACE[1]).abs() < 1e-3, "{id}: {start:?}");
            assert!((0.41..0.43).contains(&z), "{id}: {start:?}");
        }
        let step = env.step(&[0.0; 4]).expect("a step");
        assert_eq!(step.observation.desired_goal(), GOAL, "{id}");
    }
}

pub(crate) fn wishes_do_not_disturb_the_random_numbers<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        env.reset(Some(4)).expect("a reset");
        let next = env.reset(None).expect("a reset");
        env.reset_with(Some(4), &wishes(id)).expect("possible wishes");
        let next_after_wishes = env.reset(None).expect("a reset");
        assert_eq!(bits(&next.observation), bits(&next_after_wishes.observation), "{id}");
    }
}

pub(crate) fn impossible_wishes_are_refused_and_change_nothing<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        let mut twin = make::<B>(id);
        env.reset(Some(5)).expect("a reset");
        twin.reset(Some(5)).expect("a reset");
        random_steps::<B>(&mut env, 5, 10);
        random_steps::<B>(&mut twin, 5, 10);

        let nowhere = FetchResetOptions {
            desired_goal: Some([1.3, f64::NAN, 0.5]),
            ..FetchResetOptions::default()
        };
        let refusal = env.reset_with(Some(6), &nowhere);
        assert!(
            matches!(
                refusal,
                Err(EnvError::OptionNotFinite { option: "desired_goal", index: 1, .. })
            ),
            "{id}: {refusal:?}"
        );
        let place = if id.task.has_object() { [f64::INFINITY, 0.7] } else { PLACE };
        let misplaced = FetchResetOptions { object_position: Some(place), ..Default::default() };
        let refusal = env.reset_with(None, &misplaced).expect_err("a refusal");
        if id.task.has_object() {
            let option = "object_position";
            let expected = EnvError::OptionNotFinite { option, index: 0, value: f64::INFINITY };
            assert_eq!(refusal, expected, "{id}");
        } else {
            assert_eq!(refusal, EnvError::Sim(SimError::NoObject { task: id.task }), "{id}");
        }
        assert_eq!(
            trajectory_bits(&random_steps::<B>(&mut env, 6, 60)),
            trajectory_bits(&random_steps::<B>(&mut twin, 6, 60)),
            "{id}: a refused reset changed the episode"
        );
    }
}

pub(crate) fn the_seed_can_be_told<B: Backend>() {
    for id in EnvId::ALL {
        let mut env = make::<B>(id);
        assert_eq!(env.inner().np_random_seed(), None);
        let unseeded = env.reset(None).expect("a reset");
        let seed = env.inner().np_random_seed().expect("a seed");
        let seeded = env.reset(Some(seed)).expect("a reset");
        assert_eq!(bits(&unseeded.observation), bits(&seeded.observation), "{id}");
        env.reset(None).expect("a reset");
        assert_eq!(env.inner().np_random_seed(), Some(seed), "{id}: it goes on with the stream");
    }
}
