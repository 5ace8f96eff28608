//! The parts of the faulty environment: its actions, rewards, infos and observations.

use fetch_env::{
    ActionSpace, BatchObservation, BoxSpace, EnvError, GoalObservation, Info, Space,
    spaces::SpaceError, vec_env::GoalRows,
};
use goal_reward::{DistanceReward, GoalError, GoalPairs, GoalReward};
use rand_core::Rng;

use crate::faulty::Fault;

/// The actions of the environment, with its fault.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FaultyActions {
    pub(crate) space: BoxSpace<f32>,
    pub(crate) fault: Fault,
}

impl From<FaultyActions> for Space {
    fn from(actions: FaultyActions) -> Self {
        actions.space.into()
    }
}

impl ActionSpace for FaultyActions {
    type Element = f32;

    fn action_len(&self) -> usize {
        self.space.action_len()
    }

    fn check_action(&self, action: &[f32]) -> Result<(), EnvError> {
        if self.fault == Fault::RefusesItsSamples {
            return Err(EnvError::ActionLength { expected: 0, actual: action.len() });
        }
        self.space.check_action(action)
    }

    fn invalid_elements(&self, index: usize) -> Vec<f32> {
        self.space.invalid_elements(index)
    }

    fn sample_action<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        action: &mut [f32],
    ) -> Result<(), SpaceError> {
        self.space.sample_action(rng, action)
    }
}

/// The reward of the environment, with its fault.
pub(crate) struct FaultyReward {
    pub(crate) reward: DistanceReward,
    pub(crate) fault: Fault,
}

impl GoalReward for FaultyReward {
    fn reward(&self, achieved: &[f64], desired: &[f64]) -> f64 {
        self.reward.reward(achieved, desired)
    }

    fn is_success(&self, achieved: &[f64], desired: &[f64]) -> bool {
        match self.fault {
            Fault::NeverSucceeds => false,
            Fault::OnlyMissesSucceed => !self.reward.is_success(achieved, desired),
            _ => self.reward.is_success(achieved, desired),
        }
    }

    fn terminated(&self, _: &[f64], _: &[f64]) -> bool {
        self.fault == Fault::TerminatesAtOnce
    }

    fn truncated(&self, _: &[f64], _: &[f64]) -> bool {
        self.fault == Fault::TruncatesAtOnce
    }

    fn reward_batch(&self, pairs: GoalPairs<'_>, rewards: &mut [f64]) -> Result<(), GoalError> {
        self.reward.reward_batch(pairs, rewards)?;
        if self.fault == Fault::BatchOffByABit {
            rewards[1] = rewards[1].next_up();
        }
        Ok(())
    }

    fn try_reward(&self, achieved: &[f64], desired: &[f64]) -> Result<f64, GoalError> {
        if self.fault == Fault::TakesBadGoals {
            return Ok(self.reward(achieved, desired));
        }
        self.reward.try_reward(achieved, desired)
    }
}

/// An info with a number that no law is about.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct NotedInfo {
    pub(crate) info: Info,
    pub(crate) note: f64,
}

impl AsRef<Info> for NotedInfo {
    fn as_ref(&self) -> &Info {
        &self.info
    }
}

/// An observation that faults can change.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Observation {
    pub(crate) observation: Vec<f64>,
    pub(crate) achieved_goal: Vec<f64>,
    pub(crate) desired_goal: Vec<f64>,
}

impl BatchObservation for Observation {
    type Rows = GoalRows<f64>;
}

impl GoalObservation for Observation {
    type Element = f64;

    fn observation(&self) -> &[f64] {
        &self.observation
    }

    fn achieved_goal(&self) -> &[f64] {
        &self.achieved_goal
    }

    fn desired_goal(&self) -> &[f64] {
        &self.desired_goal
    }
}
