//! Observations and rewards transformed by functions.

use std::fmt;

use goal_reward::{GoalError, GoalPairs, GoalReward};

use super::macros::{keep, observe};
use super::wrapped::{GoalWrapper, Stateless, Wrapped, Wrapper};
use crate::gym::env::goal::{GoalEnv, GoalInfo};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{ActionElement, Env, Step};
use crate::gym::{error::EnvError, spaces::Space};

/// An environment whose observations a function transforms.
///
/// The function must be pure: equal observations give equal results. It is no
/// [`GoalEnv`](crate::GoalEnv), because the function could change the goals; wrappers of the
/// [vector](super::VectorObservation) beside the goals keep them. A step allocates what the function
/// does.
///
/// ```
/// use fetch_env::{BoxSpace, Env, GoalObservation, make_kinematic, wrappers::TransformObservation};
///
/// // The way to the goal, as an array without allocation.
/// let space = BoxSpace::<f32>::unbounded(3)?.into();
/// let env = make_kinematic("FetchReach-v4")?;
/// let mut env = TransformObservation::new(env, space, |observation| {
///     let (from, to) = (observation.achieved_goal(), observation.desired_goal());
///     std::array::from_fn::<f32, 3, _>(|axis| (to[axis] - from[axis]) as f32)
/// });
/// let [x, y, z] = env.reset(Some(0))?.observation;
/// assert!(x.hypot(y).hypot(z) < 0.3);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type TransformObservation<E, F> = Wrapped<E, ObservationTransform<F>>;

/// The wrapper of a [`TransformObservation`].
#[derive(Clone)]
pub struct ObservationTransform<F> {
    transform: F,
    observation_space: Space,
}

impl<E: Env, F, O> TransformObservation<E, F>
where
    F: Fn(E::Observation) -> O,
    O: Clone + fmt::Debug + PartialEq,
{
    /// Transforms the observations of `env` to members of `observation_space`.
    #[must_use]
    pub const fn new(env: E, observation_space: Space, transform: F) -> Self {
        Self::from_parts(env, ObservationTransform { transform, observation_space })
    }
}

impl<F> ObservationTransform<F> {
    fn observe<O, P>(&mut self, observation: O, _is_first: bool) -> Result<P, EnvError>
    where
        F: Fn(O) -> P,
    {
        Ok((self.transform)(observation))
    }
}

impl<E: Env, F, O> Wrapper<E> for ObservationTransform<F>
where
    F: Fn(E::Observation) -> O,
    O: Clone + fmt::Debug + PartialEq,
{
    type Observation = O;
    keep!(Info, ActionSpace);
    observe!();

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

impl<F> Stateless for ObservationTransform<F> {}

/// An environment whose rewards a function transforms.
///
/// The function must be pure: equal rewards give equal results. Made by
/// [`with_goals`](Wrapped::with_goals), it is a [`GoalEnv`](crate::GoalEnv) that keeps its law: the
/// same function transforms its [`goal_reward`](crate::GoalEnv::goal_reward), so that relabeled
/// rewards are transformed, too. Success and the ends of episodes stay. A step allocates nothing.
///
/// ```
/// use fetch_env::{Env, GoalEnvExt, GoalObservation, make_kinematic, wrappers::TransformReward};
///
/// // 1 at the goal, 0 elsewhere.
/// let mut env = TransformReward::with_goals(make_kinematic("FetchReach-v4")?, |r| r + 1.0);
/// env.reset(Some(0))?;
/// let step = env.step(&[0.0; 4])?;
/// assert_eq!(step.reward, 0.0);
/// let achieved = step.observation.achieved_goal();
/// assert_eq!(env.compute_reward(achieved, achieved)?, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub type TransformReward<E, F, R = ()> = Wrapped<E, TransformedReward<R, F>>;

/// A reward transformed by a function: the wrapper of a [`TransformReward`], and as a function of
/// goals its [`GoalReward`].
#[derive(Clone, Copy)]
pub struct TransformedReward<R, F> {
    reward: R,
    transform: F,
}

impl<R, F: Fn(f64) -> f64> TransformedReward<R, F> {
    /// Transforms the rewards that `reward` gives.
    #[must_use]
    pub const fn new(reward: R, transform: F) -> Self {
        Self { reward, transform }
    }
}

impl<E: Env, F: Fn(f64) -> f64> TransformReward<E, F> {
    /// Transforms the rewards of any environment, which is then no [`GoalEnv`](crate::GoalEnv).
    #[must_use]
    pub const fn new(env: E, transform: F) -> Self {
        Self::from_parts(env, TransformedReward::new((), transform))
    }
}

impl<E: GoalEnv, F: Fn(f64) -> f64> TransformReward<E, F, E::GoalReward>
where
    E::GoalReward: Clone,
{
    /// Transforms the rewards of a goal-conditioned environment, computed ones included.
    #[must_use]
    pub fn with_goals(env: E, transform: F) -> Self {
        let reward = env.goal_reward().clone();
        Self::from_parts(env, TransformedReward::new(reward, transform))
    }
}

impl<R, F: Fn(f64) -> f64, E: Env> Wrapper<E> for TransformedReward<R, F> {
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

impl<E, R, F> GoalWrapper<E> for TransformedReward<R, F>
where
    E: GoalEnv<GoalReward = R, Observation: GoalObservation, Info: GoalInfo>,
    R: GoalReward,
    F: Fn(f64) -> f64,
{
    type GoalReward = Self;

    fn goal_reward<'a>(&'a self, _env: &'a E) -> &'a Self {
        self
    }
}

impl<R, F> Stateless for TransformedReward<R, F> {}

impl<R: GoalReward, F: Fn(f64) -> f64> GoalReward for TransformedReward<R, F> {
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

impl<F> fmt::Debug for ObservationTransform<F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ObservationTransform").finish_non_exhaustive()
    }
}

impl<R: fmt::Debug, F> fmt::Debug for TransformedReward<R, F> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("TransformedReward").field("reward", &self.reward).finish_non_exhaustive()
    }
}
