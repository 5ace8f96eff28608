//! A wrapper whose info says more than the environment's: how close the episode has come to its
//! goal so far. Everything else is the wrapped environment's, above all the rewards.

use fetch_env::{ActionElement, Env, EnvError, GoalEnv, GoalInfo, Reset, SnapshotEnv, Space, Step};
use serde::{Deserialize, Serialize};

/// An environment that reports the smallest distance of the episode.
#[derive(Clone, Debug)]
pub struct Closest<E> {
    env: E,
    closest: f64,
}

/// The environment's own info, and what the wrapper adds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestInfo<I> {
    pub own: I,
    /// The smallest distance between the goals since the reset.
    pub closest: f64,
}

/// The common part is the environment's own.
impl<I: GoalInfo> GoalInfo for ClosestInfo<I> {
    fn is_success(&self) -> bool {
        self.own.is_success()
    }

    fn distance(&self) -> f64 {
        self.own.distance()
    }
}

impl<E: GoalEnv> Closest<E> {
    /// Wraps an environment, which must be reset before its next step.
    pub const fn new(env: E) -> Self {
        Self { env, closest: f64::INFINITY }
    }

    fn info(&mut self, own: E::Info) -> ClosestInfo<E::Info> {
        self.closest = self.closest.min(own.distance());
        ClosestInfo { own, closest: self.closest }
    }
}

impl<E: GoalEnv> Env for Closest<E> {
    type Observation = E::Observation;
    type Info = ClosestInfo<E::Info>;
    type ActionSpace = E::ActionSpace;
    type ResetOptions = E::ResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, Self::Info>, EnvError> {
        let Reset { observation, info } = self.env.reset_with(seed, options)?;
        self.closest = f64::INFINITY;
        Ok(Reset { observation, info: self.info(info) })
    }

    fn step(
        &mut self,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, Self::Info>, EnvError> {
        let Step { observation, reward, terminated, truncated, info } = self.env.step(action)?;
        Ok(Step { observation, reward, terminated, truncated, info: self.info(info) })
    }

    fn action_space(&self) -> &E::ActionSpace {
        self.env.action_space()
    }

    fn observation_space(&self) -> &Space {
        self.env.observation_space()
    }
}

/// Rewards, success and termination follow from this one method.
impl<E: GoalEnv> GoalEnv for Closest<E> {
    type GoalReward = E::GoalReward;

    fn goal_reward(&self) -> &E::GoalReward {
        self.env.goal_reward()
    }
}

/// The state of both. `None` stands for the infinity before the first reset, which JSON has not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClosestSnapshot<S> {
    env: S,
    closest: Option<f64>,
}

impl<E: GoalEnv + SnapshotEnv> SnapshotEnv for Closest<E> {
    type Snapshot = ClosestSnapshot<E::Snapshot>;

    fn snapshot(&self) -> Self::Snapshot {
        let closest = self.closest.is_finite().then_some(self.closest);
        ClosestSnapshot { env: self.env.snapshot(), closest }
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        self.env.restore(&snapshot.env)?;
        self.closest = snapshot.closest.unwrap_or(f64::INFINITY);
        Ok(())
    }
}
