//! Laws of resets, steps and snapshots: results lie in their space and are reproducible.

use super::report::{Failure, Outcome, ensure};
use super::same::{ensure_same_reset, ensure_same_steps, same_observation};
use super::subject::{Checked, Subject, random_action, random_steps, same_steps};
use crate::gym::env::observation::BatchObservation;
use crate::gym::{env::SnapshotEnv, error::EnvError};

/// The first observation lies in its space.
pub(super) fn reset_in_space<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let (env, reset) = subject.started()?;
    let value = reset.observation.to_value(env.observation_space())?;
    ensure(env.observation_space().contains(&value), || {
        format!("{value:?} is not in {:?}", env.observation_space())
    })?;
    Ok("it lies in its space".into())
}

/// A seed determines the start, and the starts of later resets without a seed, in any environment
/// and after any history.
pub(super) fn reset_is_deterministic<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let (mut env, first) = subject.started()?;
    let second = env.reset(None)?;
    random_steps(&mut env, &mut subject.rng(), subject.options.num_steps().min(10))?;
    let first_again = env.reset(Some(subject.options.seed()))?;
    ensure_same_reset("two resets with one seed", &env, &first, &first_again)?;
    let second_again = env.reset(None)?;
    ensure_same_reset("the resets that follow", &env, &second, &second_again)?;

    let (mut twin, twin_first) = subject.started()?;
    ensure_same_reset("two environments", &env, &first, &twin_first)?;
    ensure_same_reset("the second resets of two", &env, &second, &twin.reset(None)?)?;

    ensure(!same_observation(&env, &first.observation, &second.observation)?, || {
        "a reset without a seed restarts the stream instead of continuing it".into()
    })?;
    Ok("equal to the last bit, in two environments; the stream continues".into())
}

/// Different seeds give different starts.
pub(super) fn seeds_differ<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    const SEEDS: usize = 10;
    let mut env = subject.env()?;
    let mut starts: Vec<E::Observation> = Vec::new();
    for offset in 0..SEEDS as u64 {
        let seed = subject.options.seed().wrapping_add(offset);
        let start = env.reset(Some(seed))?.observation;
        for other in &starts {
            ensure(!same_observation(&env, other, &start)?, || {
                format!("seed {seed} gives the same start {start:?} as another")
            })?;
        }
        starts.push(start);
    }
    Ok(format!("{SEEDS} seeds, {SEEDS} starts"))
}

/// Environments that never received a seed start differently.
pub(super) fn unseeded<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let mut env = subject.env()?;
    let [first, second] = [env.reset(None)?, subject.env()?.reset(None)?];
    ensure(!same_observation(&env, &first.observation, &second.observation)?, || {
        format!("two environments without a seed start alike: {first:?}")
    })?;
    Ok("two environments start differently".into())
}

/// Default options change nothing.
pub(super) fn default_options<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let (env, reset) = subject.started()?;
    let with_options =
        subject.env()?.reset_with(Some(subject.options.seed()), &E::ResetOptions::default())?;
    ensure_same_reset("a reset with and one without default options", &env, &reset, &with_options)?;
    Ok("the default ones change nothing".into())
}

/// Sampled actions are accepted and give finite rewards and observations in their space.
pub(super) fn step_in_space<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let value = transition.step.observation.to_value(transition.env.observation_space())?;
        let space = transition.env.observation_space();
        ensure(space.contains(&value), || format!("{value:?} is not in {space:?}"))?;
        let reward = transition.step.reward;
        ensure(reward.is_finite(), || format!("the reward is {reward}"))
    })?;
    Ok(format!("{steps} steps"))
}

/// A seed and a sequence of actions determine the trajectory, even across the ends of episodes.
pub(super) fn step_is_deterministic<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.options.num_steps();
    let (mut env, _) = subject.started()?;
    let first = random_steps(&mut env, &mut subject.rng(), steps)?;
    env.reset(Some(subject.options.seed()))?;
    let again = random_steps(&mut env, &mut subject.rng(), steps)?;
    ensure_same_steps(&env, &first, &again)?;
    let (mut twin, _) = subject.started()?;
    ensure_same_steps(&env, &first, &random_steps(&mut twin, &mut subject.rng(), steps)?)?;
    Ok(format!("{steps} steps, twice and in another environment, equal to the last bit"))
}

/// No episode is longer than the time limit.
pub(super) fn limit<E: Checked>(subject: &Subject<'_, E>) -> Outcome {
    let Some(limit) = subject.options.max_episode_steps() else {
        return Ok("there should be none".into());
    };
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    for elapsed in 1..=limit.get() {
        let step = env.step(&random_action(&env, &mut rng)?)?;
        if step.is_last() {
            return Ok(format!("the episode ended at step {elapsed} of at most {limit}"));
        }
    }
    Err(Failure::new(format!("the episode was not over after {limit} steps")))
}

/// The numbers of steps after which snapshots are taken.
const DEPTHS: [u32; 4] = [0, 1, 7, 30];

/// After a snapshot the same actions give the same results, including resets without a seed, in the
/// environment that `other` returns: the same one, or another into which the snapshot is restored.
pub(super) fn snapshot<E: Checked + SnapshotEnv>(
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
        let again = random_steps(&mut other, &mut rng, steps)?;
        ensure_same_steps(&other, &first, &again)?;
    }
    Ok(format!("{steps} steps, from {} places", DEPTHS.len()))
}

/// What to do if a snapshot does not hold everything.
const HIDDEN: &str = "a snapshot does not hold all that an episode changes: keep none of it in a \
                      Cell, a Mutex or a static, but in the Memory of a task, the State of a \
                      wrapper, or the Snapshot of another environment";

/// Snapshots that were taken along some episodes lead on as they did then, in an environment that
/// has seen nothing else and in the one that has seen all of these episodes.
pub(super) fn hidden_state<E: Checked + SnapshotEnv>(subject: &Subject<'_, E>) -> Outcome {
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    let mut pieces = Vec::new();
    for _ in 0..subject.options.num_steps().div_ceil(2) {
        let (snapshot, action) = (env.snapshot(), random_action(&env, &mut rng)?);
        let steps = same_steps(&mut env, &action)?;
        pieces.push((snapshot, action, steps));
    }
    for (snapshot, action, steps) in &pieces {
        for env in [&mut subject.env()?, &mut env] {
            env.restore(snapshot)?;
            let again = same_steps(env, action)?;
            ensure_same_steps(env, steps, &again).map_err(|failure| failure.advised(HIDDEN))?;
        }
    }
    Ok(format!("none seen, from {} places", pieces.len()))
}

/// A snapshot from before the first reset restores that state.
pub(super) fn snapshot_before_reset<E: Checked + SnapshotEnv>(subject: &Subject<'_, E>) -> Outcome {
    let mut env = subject.env()?;
    let snapshot = env.snapshot();
    let first = env.reset(Some(subject.options.seed()))?;
    env.restore(&snapshot)?;
    let refusal = env.step(&random_action(&env, &mut subject.rng())?);
    ensure(refusal == Err(EnvError::ResetNeeded), || format!("a step then gave {refusal:?}"))?;
    let again = env.reset(Some(subject.options.seed()))?;
    ensure_same_reset("the resets before and after", &env, &first, &again)?;
    Ok("a reset is needed again".into())
}
