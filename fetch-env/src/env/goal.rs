use std::fmt::Debug;

use goal_reward::{GoalError, GoalPairs, GoalReward};
use serde::{Deserialize, Serialize};

use crate::{Env, spaces::Value};

/// An environment whose task is to bring about a desired goal.
///
/// The law of every goal-conditioned environment, which hindsight relabeling relies upon, bit for
/// bit: the reward of a step is [`compute_reward`](Self::compute_reward) of the observed
/// `achieved_goal` and `desired_goal`, and `terminated` is
/// [`compute_terminated`](Self::compute_terminated) of them. A step is `truncated` where
/// [`compute_truncated`](Self::compute_truncated) says so, and at a time limit.
pub trait GoalEnv: Env<Observation: GoalObservation, Info = Info> {
    /// The reward as a function of the goals.
    type GoalReward: GoalReward;

    /// The reward as a function of the goals, as a hindsight buffer wants it.
    fn goal_reward(&self) -> &Self::GoalReward;

    /// The reward that a step would give with these goals.
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

    /// [`compute_reward`](Self::compute_reward) of every pair, written to `rewards`.
    ///
    /// # Errors
    /// [`GoalError`] if a goal is not finite or `rewards` has not one element for each pair;
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

    /// Whether the achieved goal counts as the desired one; goals without a distance never do.
    fn is_success(&self, achieved_goal: &[f64], desired_goal: &[f64]) -> bool {
        self.goal_reward().is_success(achieved_goal, desired_goal)
    }
}

/// The contents of a wrapper's `impl GoalEnv`: all as its field `env` has it.
macro_rules! as_in_the_environment_below {
    () => {
        type GoalReward = E::GoalReward;

        fn goal_reward(&self) -> &E::GoalReward {
            self.env.goal_reward()
        }

        fn compute_reward(
            &self,
            achieved: &[f64],
            desired: &[f64],
        ) -> Result<f64, goal_reward::GoalError> {
            self.env.compute_reward(achieved, desired)
        }

        fn compute_reward_batch(
            &self,
            pairs: goal_reward::GoalPairs<'_>,
            rewards: &mut [f64],
        ) -> Result<(), goal_reward::GoalError> {
            self.env.compute_reward_batch(pairs, rewards)
        }

        fn compute_terminated(&self, achieved: &[f64], desired: &[f64]) -> bool {
            self.env.compute_terminated(achieved, desired)
        }

        fn compute_truncated(&self, achieved: &[f64], desired: &[f64]) -> bool {
            self.env.compute_truncated(achieved, desired)
        }

        fn is_success(&self, achieved: &[f64], desired: &[f64]) -> bool {
            self.env.is_success(achieved, desired)
        }
    };
}
pub(crate) use as_in_the_environment_below;

/// An observation with the two goals beside it.
pub trait GoalObservation: Clone + Debug + PartialEq {
    /// What a policy sees besides the goal.
    fn observation(&self) -> &[f64];

    /// The goal that the state amounts to.
    fn achieved_goal(&self) -> &[f64];

    /// The goal that was asked for; constant throughout an episode.
    fn desired_goal(&self) -> &[f64];

    /// The three parts as a value of the environment's observation space.
    fn to_value(&self) -> Value {
        let parts = [
            ("achieved_goal", self.achieved_goal()),
            ("desired_goal", self.desired_goal()),
            ("observation", self.observation()),
        ];
        Value::Dict(parts.map(|(key, part)| (key.into(), Value::F64(part.into()))).into())
    }
}

/// What a goal-conditioned environment tells besides the observation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Info {
    /// Whether the achieved goal counts as the desired one.
    pub is_success: bool,
    /// Euclidean distance between the two, in the goals' unit: meters in the Fetch tasks.
    pub distance: f64,
}
