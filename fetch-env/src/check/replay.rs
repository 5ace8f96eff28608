//! Laws of resets, steps and snapshots: results lie in their space and are reproducible.

use super::report::{Outcome, ensure};
use super::subject::{
    Subject, ensure_same_reset, ensure_same_steps, random_steps, same_bits, same_observation,
};
use crate::env::goal::{GoalEnv, GoalObservation};
use crate::{env::SnapshotEnv, error::EnvError};

/// The first observation lies in its space, and both goals have the same length.
pub(super) fn reset_in_space<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
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

/// A seed gives one start, in any environment and after any history, and so do the resets that
/// follow without a seed.
pub(super) fn reset_is_deterministic<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let (mut env, first) = subject.started()?;
    let second = env.reset(None)?;
    random_steps(&mut env, &mut subject.rng(), subject.options.num_steps().min(10))?;
    let first_again = env.reset(Some(subject.options.seed()))?;
    ensure_same_reset("two resets with one seed", &first, &first_again)?;
    let second_again = env.reset(None)?;
    ensure_same_reset("the resets that follow", &second, &second_again)?;

    let (mut twin, twin_first) = subject.started()?;
    ensure_same_reset("two environments", &first, &twin_first)?;
    ensure_same_reset("the second resets of two", &second, &twin.reset(None)?)?;

    ensure(!same_observation(&first.observation, &second.observation), || {
        "a reset without a seed restarts the stream instead of continuing it".into()
    })?;
    Ok("equal to the last bit, in two environments; the stream continues".into())
}

/// Different seeds give different goals.
pub(super) fn seeds_differ<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    const SEEDS: usize = 10;
    let mut env = subject.env()?;
    let mut goals: Vec<Vec<f64>> = Vec::new();
    for offset in 0..SEEDS as u64 {
        let seed = subject.options.seed().wrapping_add(offset);
        let observation = env.reset(Some(seed))?.observation;
        let goal = observation.desired_goal();
        ensure(!goals.iter().any(|other| same_bits(other, goal)), || {
            format!("seed {seed} gives the goal {goal:?} of another")
        })?;
        goals.push(goal.into());
    }
    Ok(format!("{SEEDS} seeds, {SEEDS} goals"))
}

/// Environments that never received a seed start differently.
pub(super) fn unseeded<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let [first, second] = [subject.env()?.reset(None)?, subject.env()?.reset(None)?];
    ensure(!same_observation(&first.observation, &second.observation), || {
        format!("two environments without a seed start alike: {first:?}")
    })?;
    Ok("two environments start differently".into())
}

/// Default options change nothing.
pub(super) fn default_options<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let (_, reset) = subject.started()?;
    let with_options =
        subject.env()?.reset_with(Some(subject.options.seed()), &E::ResetOptions::default())?;
    ensure_same_reset("a reset with and one without default options", &reset, &with_options)?;
    Ok("the default ones change nothing".into())
}

/// Sampled actions are accepted and give finite rewards and observations in their space.
pub(super) fn step_in_space<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let value = transition.step.observation.to_value();
        let space = transition.env.observation_space();
        ensure(space.contains(&value), || format!("{value:?} is not in {space:?}"))?;
        let reward = transition.step.reward;
        ensure(reward.is_finite(), || format!("the reward is {reward}"))
    })?;
    Ok(format!("{steps} steps"))
}

/// A seed and a sequence of actions give one trajectory, across the ends of episodes too.
pub(super) fn step_is_deterministic<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.options.num_steps();
    let (mut env, _) = subject.started()?;
    let first = random_steps(&mut env, &mut subject.rng(), steps)?;
    env.reset(Some(subject.options.seed()))?;
    ensure_same_steps(&first, &random_steps(&mut env, &mut subject.rng(), steps)?)?;
    let (mut twin, _) = subject.started()?;
    ensure_same_steps(&first, &random_steps(&mut twin, &mut subject.rng(), steps)?)?;
    Ok(format!("{steps} steps, twice and in another environment, equal to the last bit"))
}

/// The numbers of steps after which snapshots are taken.
const DEPTHS: [u32; 4] = [0, 1, 7, 30];

/// After a snapshot the same actions give the same results, resets without a seed included, in the
/// environment that `other` returns: the same one, or another into which the snapshot is restored.
pub(super) fn snapshot<E: GoalEnv + SnapshotEnv>(
    subject: &Subject<'_, E>,
    other: impl Fn(E) -> Result<E, EnvError>,
) -> Outcome {
    let steps = subject.options.num_steps();
    for depth in DEPTHS {
        let (mut env, _) = subject.started()?;
        let mut rng = subject.rng();
        random_steps(&mut env, &mut rng, depth)?;
        let snapshot = env.snapshot();
        let first = random_steps(&mut env, &mut rng.clone(), steps)?;
        let mut other = other(env)?;
        other.restore(&snapshot)?;
        ensure(other.snapshot() == snapshot, || "a snapshot is not what was restored".into())?;
        ensure_same_steps(&first, &random_steps(&mut other, &mut rng, steps)?)?;
    }
    Ok(format!("{steps} steps, from {} places", DEPTHS.len()))
}

/// A snapshot from before the first reset restores that state.
pub(super) fn snapshot_before_reset<E: GoalEnv + SnapshotEnv>(subject: &Subject<'_, E>) -> Outcome {
    let mut env = subject.env()?;
    let snapshot = env.snapshot();
    let first = env.reset(Some(subject.options.seed()))?;
    env.restore(&snapshot)?;
    let refusal = env.step(&env.action_space().sample(&mut subject.rng()));
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("a step then gave {refusal:?}"))?;
    let again = env.reset(Some(subject.options.seed()))?;
    ensure_same_reset("the resets before and after", &first, &again)?;
    Ok("a reset is needed again".into())
}
