//! Laws of an environment's interface: its spaces, and the calls that it refuses.

use super::report::{Failure, Outcome, ensure};
use super::subject::{Subject, ensure_same_steps, random_steps};
use crate::{env::goal::GoalEnv, error::EnvError, spaces::Space};

/// The action space is bounded, symmetric and within ±1, as Gymnasium and Stable-Baselines3
/// recommend, and contains its samples.
pub(super) fn action_space<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let env = subject.env()?;
    let space = env.action_space();
    ensure(!space.is_empty(), || "it has no elements".into())?;
    for (index, (&low, &high)) in space.low().iter().zip(space.high()).enumerate() {
        ensure(-high == low && 0.0 < high && high <= 1.0, || {
            format!("element {index} is between {low} and {high}, not symmetric within [-1, 1]")
        })?;
    }
    let mut rng = subject.rng();
    for _ in 0..100 {
        let sample = space.sample(&mut rng);
        ensure(space.contains(&sample), || format!("its sample {sample:?} lies outside"))?;
    }
    Ok(format!("{:?} numbers within [-1, 1]", space.shape()))
}

/// The observation space is a dictionary with `observation`, `achieved_goal` and `desired_goal`,
/// and the goals have the same shape. Further keys are allowed.
pub(super) fn observation_space<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    const KEYS: [&str; 3] = ["achieved_goal", "desired_goal", "observation"];
    let env = subject.env()?;
    let dict =
        env.observation_space().as_dict().ok_or_else(|| Failure::new("it is not a dictionary"))?;
    let keys: Vec<_> = dict.iter().map(|(key, _)| key).collect();
    let all = KEYS.iter().all(|key| keys.contains(key));
    ensure(all, || format!("its keys are {keys:?}, which must include {KEYS:?}"))?;
    let mut shapes = Vec::new();
    for key in KEYS {
        let Some(Space::BoxF64(space)) = dict.get(key) else {
            return Err(Failure::new(format!("{key} is not a box of double precision")));
        };
        ensure(!space.is_empty(), || format!("{key} has no elements"))?;
        let open = space.low().iter().zip(space.high()).all(|(low, high)| low < high);
        ensure(open, || format!("an element of {key} can have only one value"))?;
        shapes.push(space.shape());
    }
    ensure(shapes[0] == shapes[1], || format!("the goals' shapes differ: {shapes:?}"))?;
    Ok(format!("{:?} numbers, goals of {:?}", shapes[2], shapes[0]))
}

/// A step before the first reset is refused and does no harm.
pub(super) fn step_before_reset<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let mut env = subject.env()?;
    let action = env.action_space().sample(&mut subject.rng());
    let refusal = env.step(&action);
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("it gave {refusal:?}"))?;
    env.reset(Some(subject.options.seed()))?;
    env.step(&action)?;
    Ok("it asks for a reset".into())
}

/// Actions of the wrong length and non-finite actions are refused and change nothing.
pub(super) fn bad_actions<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
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
    let steps = subject.options.num_steps();
    ensure_same_steps(
        &random_steps(&mut env, &mut subject.rng(), steps)?,
        &random_steps(&mut twin, &mut subject.rng(), steps)?,
    )?;
    Ok(format!("{refused} refused, the {steps} steps after them unchanged"))
}
