//! Observations and rewards transformed by functions.

use std::fmt;

use goal_reward::{GoalError, GoalPairs, GoalReward, Symmetry};

use super::macros::keep;
use super::wrapper::{GoalWrapper, Resetting, Stateless, Wrapper};
use crate::gym::env::goal::{GoalEnv, Info};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::{error::EnvError, spaces::Space};

/// Transforms observations by a function.
///
/// The function must be pure: equal observations give equal results. The environment is then not a
/// [`GoalEnv`](crate::GoalEnv), because the function could change the goals; wrappers that change
/// only the [vector](super::VectorObservation) keep the goals. A step allocates what the function
/// does.
///
/// ```
/// use fetch_env::wrappers::TransformObservation;
/// use fetch_env::{BoxSpace, Env, EnvExt, FetchObservation, GoalObservation, make_kinematic};
///
/// // The way to the goal, as an array without allocation.
/// let space = BoxSpace::<f32>::unbounded(3)?.into();
/// let way = TransformObservation::new(space, |observation: FetchObservation| {
///     let (from, to) = (observation.achieved_goal(), observation.desired_goal());
///     std::array::from_fn::<f32, 3, _>(|axis| (to[axis] - from[axis]) as f32)
/// });
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(way)?;
/// let [x, y, z] = env.reset(Some(0))?.observation;
/// assert!(x.hypot(y).hypot(z) < 0.3);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone)]
pub struct TransformObservation<F> {
    transform: F,
    observation_space: Space,
}

impl<F> TransformObservation<F> {
    /// Transforms observations into members of `observation_space`.
    #[must_use]
    pub const fn new(observation_space: Space, transform: F) -> Self {
        Self { transform, observation_space }
    }
}

impl<E: Env, F, O> Wrapper<E> for TransformObservation<F>
where
    F: Fn(E::Observation) -> O,
    O: Clone + fmt::Debug + PartialEq,
{
    type Observation = O;
    keep!(Info, ActionSpace);

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<O, E::Info>, EnvError> {
        env.reset_with(seed, options)?
            .try_map_observation(|observation| Ok((self.transform)(observation)))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<O, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|observation| Ok((self.transform)(observation)))
    }

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

impl<F> Stateless for TransformObservation<F> {}

/// Transforms rewards by a function.
///
/// The function must be pure: equal rewards give equal results. If
/// [`with_goal_reward`](Self::with_goal_reward) made it from the environment's reward, the
/// environment stays a [`GoalEnv`](crate::GoalEnv) and keeps its law: the same function transforms
/// the [`goal_reward`](crate::GoalEnv::goal_reward), so relabeled rewards are transformed, too.
/// Success and the ends of episodes do not change. A step allocates nothing.
///
/// ```
/// use fetch_env::wrappers::TransformReward;
/// use fetch_env::{Env, EnvExt, GoalEnv, GoalEnvExt, GoalObservation, make_kinematic};
///
/// // 1 at the goal, 0 elsewhere.
/// let env = make_kinematic("FetchReach-v4")?;
/// let transform = TransformReward::with_goal_reward(*env.goal_reward(), |r| r + 1.0);
/// let mut env = env.wrap(transform)?;
/// env.reset(Some(0))?;
/// let step = env.step(&[0.0; 4])?;
/// assert_eq!(step.reward, 0.0);
/// let achieved = step.observation.achieved_goal();
/// assert_eq!(env.compute_reward(achieved, achieved)?, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy)]
pub struct TransformReward<F, R = ()> {
    reward: R,
    transform: F,
}

impl<F: Fn(f64) -> f64> TransformReward<F> {
    /// Transforms the rewards of any environment, which is then not a [`GoalEnv`](crate::GoalEnv).
    #[must_use]
    pub const fn new(transform: F) -> Self {
        Self { reward: (), transform }
    }
}

impl<F: Fn(f64) -> f64, R: GoalReward> TransformReward<F, R> {
    /// Transforms the rewards of a goal-conditioned environment, whose
    /// [`goal_reward`](crate::GoalEnv::goal_reward) is `reward`.
    ///
    /// The result is a [`GoalReward`] itself, which transforms what `reward` gives.
    #[must_use]
    pub const fn with_goal_reward(reward: R, transform: F) -> Self {
        Self { reward, transform }
    }
}

impl<R, F: Fn(f64) -> f64, E: Env> Wrapper<E> for TransformReward<F, R> {
    keep!(Observation, Info, ActionSpace, reset);

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let mut step = env.step(action)?;
        step.reward = (self.transform)(step.reward);
        Ok(step)
    }
}

impl<E, R, F> GoalWrapper<E> for TransformReward<F, R>
where
    E: GoalEnv<GoalReward = R, Observation: GoalObservation, Info: AsRef<Info>>,
    R: GoalReward,
    F: Fn(f64) -> f64,
{
    type GoalReward = Self;

    fn goal_reward<'a>(&'a self, _env: &'a E) -> &'a Self {
        self
    }

    /// Equal rewards stay equal.
    fn symmetries(&self, env: &E) -> Vec<Symmetry> {
        env.symmetries()
    }
}

impl<R, F> Stateless for TransformReward<F, R> {}

impl<R: GoalReward, F: Fn(f64) -> f64> GoalReward for TransformReward<F, R> {
    fn reward(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> f64 {
        (self.transform)(self.reward.reward(achieved_goal, desired_goal))
    }

    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.reward.is_success(achieved_goal, desired_goal)
    }

    fn terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.reward.terminated(achieved_goal, desired_goal)
    }

    fn truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.reward.truncated(achieved_goal, desired_goal)
    }

    fn reward_batch(&self, pairs: GoalPairs<'_>, out: &mut [f64]) -> Result<(), GoalError> {
        self.reward.reward_batch(pairs, out)?;
        out.iter_mut().for_each(|reward| *reward = (self.transform)(*reward));
        Ok(())
    }

    fn is_success_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.reward.is_success_batch(pairs, out)
    }

    fn terminated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.reward.terminated_batch(pairs, out)
    }

    fn truncated_batch(&self, pairs: GoalPairs<'_>, out: &mut [bool]) -> Result<(), GoalError> {
        self.reward.truncated_batch(pairs, out)
    }
}

impl<F> fmt::Debug for TransformObservation<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TransformObservation").finish_non_exhaustive()
    }
}

impl<R: fmt::Debug, F> fmt::Debug for TransformReward<F, R> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TransformReward").field("reward", &self.reward).finish_non_exhaustive()
    }
}
