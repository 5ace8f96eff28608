//! Laws of goals: rewards, success, and the ends of episodes that follow from them.

use goal_reward::{GoalPairs, GoalReward, goal_distance};

use super::report::{Failure, Outcome, ensure};
use super::same::same_bits;
use super::subject::{Subject, random_action};
use crate::gym::env::goal::{GoalEnv, GoalEnvExt};
use crate::gym::env::observation::GoalObservation;
use crate::gym::error::EnvError;
use crate::gym::spaces::box_space::BoxSpace;

/// The number of random pairs of goals in a check.
const PAIRS: usize = 100;

/// Different seeds give different goals of the same length.
pub(super) fn seeds_differ<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    const SEEDS: usize = 10;
    let mut env = subject.env()?;
    let mut goals: Vec<Vec<f64>> = Vec::new();
    for offset in 0..SEEDS as u64 {
        let seed = subject.options.seed().wrapping_add(offset);
        let observation = env.reset(Some(seed))?.observation;
        let (achieved, goal) = (observation.achieved_goal(), observation.desired_goal());
        ensure(achieved.len() == goal.len(), || format!("goals {achieved:?} and {goal:?}"))?;
        ensure(!goals.iter().any(|other| same_bits(other, goal)), || {
            format!("seed {seed} gives the same goal {goal:?} as another")
        })?;
        goals.push(goal.into());
    }
    Ok(format!("{SEEDS} seeds, {SEEDS} goals"))
}

/// The goal stays the same throughout an episode.
pub(super) fn constant<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let before = transition.before.desired_goal();
        let after = transition.step.observation.desired_goal();
        ensure(same_bits(before, after), || format!("a step turned {before:?} into {after:?}"))
    })?;
    Ok(format!("{steps} steps"))
}

/// The reward of a step is the reward of its goals, bit for bit.
pub(super) fn reward_law<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let [achieved, desired] = transition.goals();
        let computed = transition.env.compute_reward(achieved, desired)?;
        let reward = transition.step.reward;
        ensure(same_bits(&[computed], &[reward]), || {
            format!("the step gave {reward}, compute_reward {computed}")
        })
    })?;
    Ok(format!("{steps} steps, bit for bit"))
}

/// The reward of any goals can be computed, singly and batched, with the same result.
pub(super) fn any_goal<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let (env, reset) = subject.started()?;
    let dim = reset.observation.desired_goal().len();
    let mut rng = subject.rng();
    let goals = BoxSpace::<f64>::unbounded(PAIRS * dim).map_err(EnvError::from)?;
    let (achieved, desired) = (goals.sample(&mut rng), goals.sample(&mut rng));
    let pairs = GoalPairs::new(&achieved, &desired, dim)?;

    let mut batch = [0.0; PAIRS];
    env.compute_reward_batch(pairs, &mut batch)?;
    for ((achieved, desired), batched) in pairs.iter().zip(batch) {
        let single = env.compute_reward(achieved, desired)?;
        ensure(single.is_finite(), || format!("{achieved:?} for {desired:?} gives {single}"))?;
        ensure(same_bits(&[single], &[batched]), || format!("{single} singly, {batched} batched"))?;
        let unchecked = env.goal_reward().reward(achieved, desired);
        ensure(same_bits(&[single], &[unchecked]), || {
            format!("{single} by the environment, {unchecked} by its goal_reward")
        })?;
        let reached = env.is_success(desired, desired) || !env.is_success(achieved, desired);
        ensure(reached, || format!("{achieved:?} counts as {desired:?}, which itself does not"))?;
    }
    let whole = env.compute_reward_batch(pairs, &mut [0.0]);
    ensure(whole.is_err(), || format!("a slice of one element took {PAIRS} rewards"))?;
    Ok(format!("{PAIRS} pairs, singly and batched"))
}

/// Goals of the wrong length and non-finite goals are refused and never count as success.
pub(super) fn bad_goals<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let (env, reset) = subject.started()?;
    let goal = reset.observation.desired_goal();
    let mut refused = 0;
    let mut refuse = |bad: &[f64]| {
        for (achieved, desired) in [(bad, goal), (goal, bad)] {
            let reward = env.compute_reward(achieved, desired);
            ensure(reward.is_err(), || format!("{achieved:?} for {desired:?} gives {reward:?}"))?;
            ensure(!env.is_success(achieved, desired), || {
                format!("{achieved:?} counts as {desired:?}")
            })?;
            refused += 1;
        }
        Ok::<(), Failure>(())
    };
    refuse(&goal[1..])?;
    refuse(&[goal, &[0.0]].concat())?;
    for index in 0..goal.len() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let mut bad = goal.to_vec();
            bad[index] = value;
            refuse(&bad)?;
        }
    }
    Ok(format!("{refused} pairs refused"))
}

/// The info's success and distance are those of the goals.
pub(super) fn info<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let mut successes = 0;
    let steps = subject.for_each_step(|transition| {
        let [achieved, desired] = transition.goals();
        let info = transition.step.info.as_ref();
        let is_success = transition.env.is_success(achieved, desired);
        ensure(info.is_success == is_success, || format!("{info:?}, but it is {is_success}"))?;
        let distance = goal_distance(achieved, desired);
        ensure(same_bits(&[info.distance], &[distance]), || {
            format!("{info:?}, but the distance is {distance}")
        })?;
        successes += u32::from(is_success);
        Ok(())
    })?;
    Ok(format!("{steps} steps, {successes} of them successes"))
}

/// Termination follows from the goals, truncation from the goals and the time limit.
pub(super) fn end_laws<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let limit = subject.options.max_episode_steps();
    let (mut terminated, mut truncated) = (0, 0);
    let steps = subject.for_each_step(|transition| {
        let (step, elapsed) = (transition.step, transition.elapsed_steps);
        let [achieved, desired] = transition.goals();
        let ends = transition.env.compute_terminated(achieved, desired);
        ensure(step.terminated == ends, || {
            format!("terminated is {}, compute_terminated {ends}", step.terminated)
        })?;
        let is_limit = limit.is_some_and(|limit| elapsed >= limit.get());
        let cut = transition.env.compute_truncated(achieved, desired) || is_limit;
        ensure(step.truncated == cut, || {
            format!("truncated is {} at step {elapsed} of at most {limit:?}", step.truncated)
        })?;
        terminated += u32::from(step.terminated);
        truncated += u32::from(step.truncated);
        Ok(())
    })?;
    Ok(format!("{steps} steps, {terminated} terminated and {truncated} truncated episodes"))
}

/// An episode without termination lasts exactly as long as the time limit.
pub(super) fn limit<E: GoalEnv>(subject: &Subject<'_, E>) -> Outcome {
    let Some(limit) = subject.options.max_episode_steps() else {
        return Ok("there should be none".into());
    };
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    for elapsed in 1..=limit.get() {
        let step = env.step(&random_action(&env, &mut rng)?)?;
        let (achieved, desired) =
            (step.observation.achieved_goal(), step.observation.desired_goal());
        if env.compute_terminated(achieved, desired) || env.compute_truncated(achieved, desired) {
            return Ok(format!("not reached: the episode ended by its own rules at {elapsed}"));
        }
        ensure(step.truncated == (elapsed == limit.get()), || {
            format!("truncated is {} at step {elapsed} of {limit}", step.truncated)
        })?;
    }
    Ok(format!("truncated at step {limit}, not before"))
}
