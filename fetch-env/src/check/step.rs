use super::{
    report::{Outcome, ensure},
    subject::{Subject, ensure_same_steps, random_steps},
};
use crate::{EnvError, GoalEnv, GoalObservation};

/// Sampled actions are taken, and give finite rewards and observations in their space.
pub(super) fn in_space<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.for_each_step(|transition| {
        let value = transition.step.observation.to_value();
        let space = transition.env.observation_space();
        ensure(space.contains(&value), || format!("{value:?} is not in {space:?}"))?;
        let reward = transition.step.reward;
        ensure(reward.is_finite(), || format!("the reward is {reward}"))
    })?;
    Ok(format!("{steps} steps"))
}

/// One seed and one sequence of actions give one trajectory, over the ends of episodes too.
pub(super) fn deterministic<E: GoalEnv>(
    subject: &Subject<'_, impl Fn() -> Result<E, EnvError>>,
) -> Outcome {
    let steps = subject.options.steps;
    let (mut env, _) = subject.started()?;
    let first = random_steps(&mut env, &mut subject.rng(), steps)?;
    env.reset(Some(subject.options.seed))?;
    ensure_same_steps(&first, &random_steps(&mut env, &mut subject.rng(), steps)?)?;
    let (mut twin, _) = subject.started()?;
    ensure_same_steps(&first, &random_steps(&mut twin, &mut subject.rng(), steps)?)?;
    Ok(format!("{steps} steps, twice and in another environment, equal to the last bit"))
}
