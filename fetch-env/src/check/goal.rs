use goal_reward::{GoalPairs, GoalReward, goal_distance};

use super::{
    report::{Failure, Outcome, ensure},
    subject::{Subject, same_bits},
};
use crate::{BoxSpace, EnvError, GoalEnv, GoalObservation};

/// How many random pairs of goals a check takes.
const PAIRS: usize = 100;

/// An episode has one goal.
pub(super) fn constant<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let before = transition.before.desired_goal();
        let after = transition.step.observation.desired_goal();
        ensure(same_bits(before, after), || format!("a step turned {before:?} into {after:?}"))
    })?;
    Ok(format!("{steps} steps"))
}

/// The reward of a step is the reward of its goals, bit for bit.
pub(super) fn reward_law<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let observation = &transition.step.observation;
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        let computed = transition.env.compute_reward(achieved, desired)?;
        let reward = transition.step.reward;
        ensure(same_bits(&[computed], &[reward]), || {
            format!("the step gave {reward}, compute_reward {computed}")
        })
    })?;
    Ok(format!("{steps} steps, bit for bit"))
}

/// A reward can be computed for any goals, one by one and batched, always the same.
pub(super) fn any_goal<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (env, reset) = subject.started()?;
    let dim = reset.observation.desired_goal().len();
    let mut rng = subject.rng();
    let goals = BoxSpace::<f64>::unbounded(PAIRS * dim);
    let (achieved, desired) = (goals.sample(&mut rng), goals.sample(&mut rng));
    let pairs = GoalPairs::new(&achieved, &desired, dim)?;

    let mut batch = [0.0; PAIRS];
    env.compute_reward_batch(pairs, &mut batch)?;
    for ((achieved, desired), batched) in pairs.iter().zip(batch) {
        let single = env.compute_reward(achieved, desired)?;
        ensure(single.is_finite(), || format!("{achieved:?} for {desired:?} gives {single}"))?;
        ensure(same_bits(&[single], &[batched]), || format!("{single} singly, {batched} batched"))?;
        let relabeled = env.goal_reward().reward(achieved, desired);
        ensure(same_bits(&[single], &[relabeled]), || {
            format!("{single} by the environment, {relabeled} by its goal_reward")
        })?;
        let reached = env.is_success(desired, desired) || !env.is_success(achieved, desired);
        ensure(reached, || format!("{achieved:?} counts as {desired:?}, which itself does not"))?;
    }
    let whole = env.compute_reward_batch(pairs, &mut [0.0]);
    ensure(whole.is_err(), || format!("one number was room enough for {PAIRS} rewards"))?;
    Ok(format!("{PAIRS} pairs, singly and batched"))
}

/// Goals that are none are refused, and never a success.
pub(super) fn bad_goals<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
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

/// What is told of success and distance is what the goals say.
pub(super) fn info<E: GoalEnv>(subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>) -> Outcome {
    let mut successes = 0;
    let steps = subject.for_each_step(|transition| {
        let observation = &transition.step.observation;
        let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
        let info = transition.step.info;
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
