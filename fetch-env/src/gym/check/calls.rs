//! Laws of an environment's interface: its spaces, and the calls that it refuses.

use super::report::{Failure, Outcome, ensure};
use super::same::ensure_same_steps;
use super::subject::{Checked, Subject, random_action, random_steps};
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::{ActionElement, goal::GoalEnv};
use crate::gym::error::EnvError;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
    element::ArrayElement,
};

/// The action space contains its samples and takes them as actions. If it is a box, it is bounded,
/// symmetric and within ±1, as Gymnasium and Stable-Baselines3 recommend.
pub(super) fn action_space<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let env = subject.env()?;
    let space = env.action_space();
    ensure(space.action_len() > 0, || "it has no elements".into())?;
    let described = space.clone().into();
    if let Space::BoxF32(space) = &described {
        for (index, (&low, &high)) in space.low().iter().zip(space.high()).enumerate() {
            ensure(-high == low && 0.0 < high && high <= 1.0, || {
                format!("element {index} is between {low} and {high}, not symmetric within [-1, 1]")
            })?;
        }
    }
    let mut rng = subject.rng();
    for _ in 0..100 {
        let sample = random_action(&env, &mut rng)?;
        let is_inside = space.check_action(&sample).is_ok()
            && described.contains(&ArrayElement::value(&sample));
        ensure(is_inside, || format!("its sample {sample:?} lies outside"))?;
    }
    Ok(match described {
        Space::BoxF32(space) => format!("{:?} numbers within [-1, 1]", space.shape()),
        other => format!("{other:?}"),
    })
}

/// Whether every element of a box can have several values.
fn is_open<T: Element>(space: &BoxSpace<T>) -> bool {
    space.low().iter().zip(space.high()).all(|(low, high)| low < high)
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
        let (shape, open) = match dict.get(key) {
            Some(Space::BoxF64(space)) => (space.shape(), is_open(space)),
            Some(Space::BoxF32(space)) if key == "observation" => (space.shape(), is_open(space)),
            _ => return Err(Failure::new(format!("{key} is not a box of double precision"))),
        };
        ensure(!shape.contains(&0), || format!("{key} has no elements"))?;
        ensure(open, || format!("an element of {key} can have only one value"))?;
        shapes.push(shape);
    }
    ensure(shapes[0] == shapes[1], || format!("the goals' shapes differ: {shapes:?}"))?;
    Ok(format!("{:?} numbers, goals of {:?}", shapes[2], shapes[0]))
}

/// A step before the first reset is refused and does no harm.
pub(super) fn step_before_reset<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let mut env = subject.env()?;
    let action = random_action(&env, &mut subject.rng())?;
    let refusal = env.step(&action);
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("it gave {refusal:?}"))?;
    env.reset(Some(subject.options.seed()))?;
    env.step(&action)?;
    Ok("it asks for a reset".into())
}

/// Actions of the wrong length or with invalid elements are refused and change nothing.
pub(super) fn bad_actions<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let (mut env, _) = subject.started()?;
    let (mut twin, _) = subject.started()?;
    let len = env.action_space().action_len();
    let mut refused = 0;
    let mut refuse = |action: &[ActionElement<E>]| {
        let refusal = env.step(action);
        let expected = env.action_space().check_action(action);
        // Compared as text, because NaN differs from itself.
        let same = match (&refusal, &expected) {
            (Err(refusal), Err(expected)) => format!("{refusal:?}") == format!("{expected:?}"),
            _ => false,
        };
        ensure(same, || format!("{action:?} gave {refusal:?}, not {expected:?}"))?;
        refused += 1;
        Ok::<(), Failure>(())
    };
    for actual in (0..len).chain([len + 1, 2 * len]) {
        refuse(&vec![ActionElement::<E>::default(); actual])?;
    }
    let valid = random_action(&twin, &mut subject.rng())?;
    for index in 0..len {
        for element in twin.action_space().invalid_elements(index) {
            let mut action = valid.clone();
            action[index] = element;
            refuse(&action)?;
        }
    }
    let steps = subject.options.num_steps();
    let first = random_steps(&mut env, &mut subject.rng(), steps)?;
    ensure_same_steps(&env, &first, &random_steps(&mut twin, &mut subject.rng(), steps)?)?;
    Ok(format!("{refused} refused, the {steps} steps after them unchanged"))
}

/// A step after the end of an episode is refused until a reset.
pub(super) fn step_after_end<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    let options = subject.options;
    let longest = options.max_episode_steps().map_or(options.num_steps(), u32::from);
    for elapsed in 1..=longest {
        let action = random_action(&env, &mut rng)?;
        if env.step(&action)?.is_last() {
            for _ in 0..2 {
                let refusal = env.step(&action);
                ensure(refusal == Err(EnvError::EpisodeOver), || format!("it gave {refusal:?}"))?;
            }
            env.reset(None)?;
            env.step(&action)?;
            return Ok(format!("it asks for a reset after step {elapsed}"));
        }
    }
    Ok(format!("no end within {longest} steps"))
}
