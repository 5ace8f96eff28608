//! Goal-conditioned environments: their goals, and the rewards that follow from them.

use goal_reward::{Dims, GoalError, GoalPairs, GoalReward, Symmetry};
use serde::{Deserialize, Serialize};

use super::action_space::ActionSpace;
use super::{Env, observation::GoalObservation};
use crate::gym::error::EnvError;
use crate::gym::spaces::error::SpaceError;

/// An environment whose task is to achieve a desired goal.
///
/// Every goal-conditioned environment keeps this law, on which hindsight relabeling relies, bit for
/// bit: the reward of a step is [`compute_reward`](GoalEnvExt::compute_reward) of the observed
/// `achieved_goal` and `desired_goal`, and `terminated` is
/// [`compute_terminated`](GoalEnvExt::compute_terminated) of them. A step is `truncated` if
/// [`compute_truncated`](GoalEnvExt::compute_truncated) says so, or at a time limit.
///
/// ```
/// use fetch_env::{GoalEnv, GoalReward, make_kinematic};
///
/// let env = make_kinematic("FetchReachDense-v4")?;
/// assert_eq!(env.goal_reward().reward(&[0.0; 3], &[0.0, 0.3, 0.4]), -0.5);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait GoalEnv: Env<Observation: GoalObservation, Info: AsRef<Info>> {
    /// The reward as a function of the goals.
    type GoalReward: GoalReward;

    /// Returns the reward as a function of the goals, as a hindsight buffer needs it.
    fn goal_reward(&self) -> &Self::GoalReward;

    /// Returns the symmetries of the task, with which a learner can make several experiences of
    /// each one; none by default.
    ///
    /// They hold for the states, the actions and the reward, even if starts and goals are drawn on
    /// one side only. If two of them combine into a third, that one is included. This allocates:
    /// call it once.
    fn symmetries(&self) -> Vec<Symmetry> {
        Vec::new()
    }
}

/// An environment whose goal can move within an episode.
///
/// ```
/// use fetch_env::{MovingGoal, make_kinematic_vec, vec_env::VecConfig};
///
/// let mut envs = make_kinematic_vec("FetchReach-v4", 4, VecConfig::default())?;
/// envs.reset(Some(0))?;
/// envs.env_mut(2).ok_or("it is in flight")?.set_desired_goal(&[1.3, 0.7, 0.5])?;
/// assert_eq!(envs.step(&[0.0; 4 * 4])?.desired_goal()[2 * 3..3 * 3], [1.3, 0.7, 0.5]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait MovingGoal {
    /// Replaces the goal of the episode, in the unit of the environment within all wrappers, meters in
    /// the built-in tasks: observations, rewards and pictures have it until the next reset. The
    /// random numbers stay as they are.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] without an episode, and [`EnvError::OptionLength`] and
    /// [`EnvError::OptionOutside`] as in a reset; then nothing has changed.
    fn set_desired_goal(&mut self, desired_goal: &[f64]) -> Result<(), EnvError>;
}

/// The methods of a [`GoalEnv`] that follow from its spaces and its
/// [`goal_reward`](GoalEnv::goal_reward).
///
/// Every [`GoalEnv`] has them; wrappers cannot forget or change one.
///
/// ```
/// use fetch_env::{GoalEnvExt, make_kinematic};
///
/// let env = make_kinematic("FetchReach-v4")?;
/// assert_eq!(env.compute_reward(&[0.0; 3], &[0.0, 0.0, 0.06])?, -1.0); // farther than 5 cm
/// assert!(env.is_success(&[0.0; 3], &[0.0, 0.0, 0.04]));
/// let dims = env.dims()?; // what a network or a replay buffer is made for
/// assert_eq!((dims.observation, dims.goal, dims.action), (10, 3, 4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait GoalEnvExt: GoalEnv {
    /// Returns the lengths of observations, goals and actions.
    ///
    /// # Errors
    /// [`SpaceError::MissingPart`] if the observation space has no observation or no goals.
    fn dims(&self) -> Result<Dims, SpaceError> {
        self.observation_space().dims(self.action_space().action_len())
    }

    /// Returns the reward that a step with these goals would give.
    ///
    /// # Errors
    /// [`GoalError`] if the goals differ in length, are empty or not finite.
    fn compute_reward(
        &self,
        achieved_goal: &[f64],
        desired_goal: &[f64],
    ) -> Result<f64, GoalError> {
        self.goal_reward().try_reward(achieved_goal, desired_goal)
    }

    /// Writes the [reward](Self::compute_reward) of every pair to `rewards`.
    ///
    /// # Errors
    /// [`GoalError`] if a goal is not finite or `rewards` does not have one element for each pair;
    /// `rewards` is then unchanged.
    fn compute_reward_batch(
        &self,
        pairs: GoalPairs<'_>,
        rewards: &mut [f64],
    ) -> Result<(), GoalError> {
        self.goal_reward().try_reward_batch(pairs, rewards)
    }

    /// Whether a step with these goals would end the task.
    fn compute_terminated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.goal_reward().terminated(achieved_goal, desired_goal)
    }

    /// Whether a step with these goals would cut the episode off, time limits aside.
    fn compute_truncated(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.goal_reward().truncated(achieved_goal, desired_goal)
    }

    /// Whether the achieved goal counts as the desired one; never true for goals without a
    /// distance.
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.goal_reward().is_success(achieved_goal, desired_goal)
    }
}

impl<E: GoalEnv + ?Sized> GoalEnvExt for E {}

/// Diagnostic information of a goal-conditioned environment.
///
/// The info of a wrapper that adds to it implements `AsRef<Info>`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[non_exhaustive]
pub struct Info {
    /// Whether the achieved goal counts as the desired one.
    pub is_success: bool,
    /// Euclidean distance between the two goals, in their unit: meters in the Fetch tasks.
    pub distance: f64,
}

impl Info {
    /// Creates the information about a state.
    #[must_use]
    pub const fn new(is_success: bool, distance: f64) -> Self {
        Self { is_success, distance }
    }
}

impl AsRef<Self> for Info {
    fn as_ref(&self) -> &Self {
        self
    }
}
