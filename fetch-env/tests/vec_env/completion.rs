//! Results that are computed for all environments together.

use fetch_env::vec_env::{AutoresetMode, Completion, VecConfig, VecEnvError, VecReset};
use fetch_env::{EnvError, make_kinematic_vec};

use crate::common::Result;

const ROWS: [bool; 2] = [true, false];
const COMPLETION: Completion<'_> = Completion {
    achieved_goal: &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
    extra: &[7.0, 8.0],
    reward: &[9.0, 10.0],
    success: &[true, true],
    rows: &ROWS,
};

#[test]
fn a_completion_replaces_the_rows_that_it_names_until_the_next_call_of_their_environment() -> Result
{
    let mut envs = make_kinematic_vec("FetchPush-v4", 2, VecConfig::default())?;
    envs.reset(Some(0))?;
    let before = envs.step(&[0.5; 8])?.clone();
    envs.complete(&COMPLETION)?;
    let after = envs.last_step();
    let achieved = [&[1.0, 2.0, 3.0], &before.achieved_goal()[3..]].concat();
    assert_eq!(after.achieved_goal(), achieved);
    assert_eq!(after.next_achieved_goal(), achieved);
    assert_eq!(after.observation()[..24], before.observation()[..24]);
    assert_eq!(after.observation()[24], 7.0);
    assert_eq!(after.observation()[25..], before.observation()[25..]);
    assert_eq!(after.desired_goal(), before.desired_goal());
    assert_eq!(after.reward(), [9.0, before.reward()[1]]);
    assert!(after.success().eq([true, before.success().nth(1) == Some(true)]));
    let goals = [&[1.0, 2.0, 3.0], &after.desired_goal()[..3]];
    assert_eq!(after.distance().next(), Some(goal_reward::goal_distance(goals[0], goals[1])));
    // Another's reset shows it again.
    let mask = [false, true];
    let reset = envs.reset_with(&VecReset { mask: Some(&mask), ..VecReset::default() })?;
    assert_eq!(reset.achieved_goal()[..3], [1.0, 2.0, 3.0]);
    assert_eq!(reset.reward()[0], 9.0);
    let step = envs.step(&[0.5; 8])?;
    assert_ne!(step.achieved_goal()[..3], [1.0, 2.0, 3.0]);
    Ok(())
}

#[test]
fn a_completion_that_does_not_fit_changes_nothing() -> Result {
    let mut envs = make_kinematic_vec("FetchPush-v4", 2, VecConfig::default())?;
    let before = envs.reset(Some(0))?.observation().to_vec();
    for (what, wrong) in [
        ("achieved_goal", Completion { achieved_goal: &[1.0], ..COMPLETION }),
        ("extra", Completion { extra: &[0.0; 3], ..COMPLETION }),
        ("extra", Completion { extra: &[0.0; 52], ..COMPLETION }),
        ("reward", Completion { reward: &[1.0], ..COMPLETION }),
        ("success", Completion { success: &[], ..COMPLETION }),
        ("rows", Completion { rows: &[true], ..COMPLETION }),
    ] {
        let refused = envs.complete(&wrong);
        assert!(
            matches!(refused, Err(VecEnvError::Count { what: named, .. }) if named == what),
            "{what}: {refused:?}"
        );
    }
    assert_eq!(envs.last_step().observation(), before);
    let config = VecConfig::default().with_autoreset(AutoresetMode::SameStep);
    let mut envs = make_kinematic_vec("FetchPush-v4", 2, config)?;
    envs.reset(Some(0))?;
    assert_eq!(envs.complete(&COMPLETION), Err(VecEnvError::Begun));
    Ok(())
}

#[test]
fn a_row_that_has_failed_keeps_its_error() -> Result {
    let mut envs = make_kinematic_vec("FetchPush-v4", 2, VecConfig::default())?;
    envs.reset(Some(0))?;
    let mut actions = [0.5; 8];
    actions[0] = f32::NAN;
    envs.step(&actions)?;
    envs.complete(&Completion { rows: &[false, true], ..COMPLETION })?;
    let step = envs.last_step();
    assert!(matches!(step.error(0), Some(EnvError::ActionNotFinite { .. })), "{:?}", step.error(0));
    assert!(step.reward()[0].is_nan());
    assert_eq!(step.reward()[1], 10.0);
    Ok(())
}
