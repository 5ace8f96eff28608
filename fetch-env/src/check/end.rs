use super::{
    report::{Outcome, ensure},
    subject::Subject,
};
use crate::{EnvError, GoalEnv, GoalObservation};

/// Termination and truncation are what the goals say, and what the time limit adds.
pub(super) fn laws<E: GoalEnv>(subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>) -> Outcome {
    let limit = subject.options.max_episode_steps;
    let (mut terminated, mut truncated) = (0, 0);
    let steps = subject.for_each_step(|transition| {
        let (step, elapsed) = (transition.step, transition.elapsed_steps);
        let goals = (step.observation.achieved_goal(), step.observation.desired_goal());
        let ends = transition.env.compute_terminated(goals.0, goals.1);
        ensure(step.terminated == ends, || {
            format!("terminated is {}, compute_terminated {ends}", step.terminated)
        })?;
        let is_limit = limit.is_some_and(|limit| elapsed >= limit.get());
        let cut = transition.env.compute_truncated(goals.0, goals.1) || is_limit;
        ensure(step.truncated == cut, || {
            format!("truncated is {} at step {elapsed} of at most {limit:?}", step.truncated)
        })?;
        terminated += u32::from(step.terminated);
        truncated += u32::from(step.truncated);
        Ok(())
    })?;
    Ok(format!("{steps} steps, {terminated} terminated and {truncated} truncated episodes"))
}

/// A whole episode without termination lasts exactly as long as the limit says.
pub(super) fn limit<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let Some(limit) = subject.options.max_episode_steps else {
        return Ok("there should be none".into());
    };
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    for elapsed in 1..=limit.get() {
        let step = env.step(&env.action_space().sample(&mut rng))?;
        if elapsed < limit.get() && step.is_last() {
            return Ok(format!("not reached: the episode ended by its own rules at {elapsed}"));
        }
        ensure(step.truncated == (elapsed == limit.get()), || {
            format!("truncated is {} at step {elapsed} of {limit}", step.truncated)
        })?;
    }
    Ok(format!("truncated at step {limit}, not before"))
}

/// A step after the end is refused, until a reset.
pub(super) fn step_after_end<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let (mut env, _) = subject.started()?;
    let mut rng = subject.rng();
    let longest = subject.options.max_episode_steps.map_or(subject.options.steps, u32::from);
    for elapsed in 1..=longest {
        let action = env.action_space().sample(&mut rng);
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
