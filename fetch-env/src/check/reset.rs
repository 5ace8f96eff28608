use super::{
    report::{Outcome, ensure},
    subject::{Subject, ensure_same_reset, random_steps, same_bits, same_observation},
};
use crate::{EnvError, GoalEnv, GoalObservation};

/// The first observation lies in its space, and both goals are of one length.
pub(super) fn in_space<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (env, reset) = subject.started()?;
    let value = reset.observation.to_value();
    ensure(env.observation_space().contains(&value), || {
        format!("{value:?} is not in {:?}", env.observation_space())
    })?;
    let achieved = reset.observation.achieved_goal();
    let desired = reset.observation.desired_goal();
    ensure(achieved.len() == desired.len(), || format!("goals {achieved:?} and {desired:?}"))?;
    Ok(format!("goals of {} elements", achieved.len()))
}

/// One seed gives one start, in any environment and after any past; so do the resets that follow.
pub(super) fn deterministic<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (mut env, first) = subject.started()?;
    let second = env.reset(None)?;
    random_steps(&mut env, &mut subject.rng(), subject.options.steps.min(10))?;
    let first_again = env.reset(Some(subject.options.seed))?;
    ensure_same_reset("two resets with one seed", &first, &first_again)?;
    let second_again = env.reset(None)?;
    ensure_same_reset("the resets that follow", &second, &second_again)?;

    let (mut twin, twin_first) = subject.started()?;
    ensure_same_reset("two environments", &first, &twin_first)?;
    ensure_same_reset("the second resets of two", &second, &twin.reset(None)?)?;

    ensure(!same_observation(&first.observation, &second.observation), || {
        "a reset without a seed starts the stream anew instead of going on".into()
    })?;
    Ok("equal to the last bit, in two environments; the stream goes on".into())
}

/// Different seeds give different goals.
pub(super) fn seeds_differ<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    const SEEDS: usize = 10;
    let mut env = subject.env()?;
    let mut goals: Vec<Vec<f64>> = Vec::new();
    for offset in 0..SEEDS as u64 {
        let seed = subject.options.seed.wrapping_add(offset);
        let observation = env.reset(Some(seed))?.observation;
        let goal = observation.desired_goal();
        ensure(!goals.iter().any(|other| same_bits(other, goal)), || {
            format!("seed {seed} gives the goal {goal:?} of another")
        })?;
        goals.push(goal.into());
    }
    Ok(format!("{SEEDS} seeds, {SEEDS} goals"))
}

/// Environments that were never given a seed do not start alike.
pub(super) fn unseeded<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let [first, second] = [subject.env()?.reset(None)?, subject.env()?.reset(None)?];
    ensure(!same_observation(&first.observation, &second.observation), || {
        format!("two environments without a seed start alike: {first:?}")
    })?;
    Ok("two environments start differently".into())
}

/// Options that wish for nothing change nothing.
pub(super) fn default_options<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (_, reset) = subject.started()?;
    let with_options =
        subject.env()?.reset_with(Some(subject.options.seed), &E::ResetOptions::default())?;
    ensure_same_reset("a reset with and one without default options", &reset, &with_options)?;
    Ok("the default ones change nothing".into())
}
