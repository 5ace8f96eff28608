use super::{
    report::{Outcome, ensure},
    subject::{Subject, ensure_same_steps, random_steps},
};
use crate::{EnvError, GoalEnv};

/// A step before the first reset is refused, and does no harm.
pub(super) fn step_before_reset<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let mut env = subject.env()?;
    let action = env.action_space().sample(&mut subject.rng());
    let refusal = env.step(&action);
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("it gave {refusal:?}"))?;
    env.reset(Some(subject.options.seed))?;
    env.step(&action)?;
    Ok("it asks for a reset".into())
}

/// Actions of the wrong length and numbers that are none are refused, and nothing changes.
pub(super) fn bad_actions<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (mut env, _) = subject.started()?;
    let (mut twin, _) = subject.started()?;
    let len = env.action_space().len();
    let mut refused = 0;
    for actual in (0..len).chain([len + 1, 2 * len]) {
        let refusal = env.step(&vec![0.0; actual]);
        let expected = EnvError::ActionLength { expected: len, actual };
        ensure(refusal == Err(expected), || format!("{actual} elements gave {refusal:?}"))?;
        refused += 1;
    }
    for index in 0..len {
        for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut action = vec![0.0; len];
            action[index] = value;
            let refusal = env.step(&action);
            let is_refused = matches!(
                &refusal,
                Err(EnvError::ActionNotFinite { index: i, value: v })
                    if *i == index && v.to_bits() == value.to_bits()
            );
            ensure(is_refused, || format!("{action:?} gave {refusal:?}"))?;
            refused += 1;
        }
    }
    let steps = subject.options.steps;
    ensure_same_steps(
        &random_steps(&mut env, &mut subject.rng(), steps)?,
        &random_steps(&mut twin, &mut subject.rng(), steps)?,
    )?;
    Ok(format!("{refused} refused, {steps} steps then as without them"))
}
