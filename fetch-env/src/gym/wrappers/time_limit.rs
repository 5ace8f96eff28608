//! The time limit of an environment's episodes.

use std::num::NonZeroU32;

use serde::{Deserialize, Serialize};

use crate::gym::env::{ActionElement, Env, Reset, SnapshotEnv, Step, goal::GoalEnv};
use crate::gym::error::EnvError;
use crate::gym::spaces::Space;

/// An environment whose episodes are truncated after a number of steps.
///
/// A step after the end, set by the limit or by the environment itself, is an error until the next
/// reset. If an episode ends in both ways in one step, both `terminated` and `truncated` are true.
#[derive(Clone, Debug)]
pub struct TimeLimit<E> {
    env: E,
    max_episode_steps: NonZeroU32,
    episode: Episode,
}

/// Progress of the episode.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Episode {
    NotStarted,
    Running { elapsed_steps: u32 },
    Over { elapsed_steps: u32 },
}

impl<E> TimeLimit<E> {
    /// Limits the episodes of `env`, which must be reset before its next step.
    #[must_use]
    pub const fn new(env: E, max_episode_steps: NonZeroU32) -> Self {
        Self { env, max_episode_steps, episode: Episode::NotStarted }
    }

    /// The number of steps after which an episode is truncated.
    #[must_use]
    pub const fn max_episode_steps(&self) -> NonZeroU32 {
        self.max_episode_steps
    }

    /// The number of steps taken in this episode; 0 before the first reset.
    #[must_use]
    pub const fn elapsed_steps(&self) -> u32 {
        match self.episode {
            Episode::NotStarted => 0,
            Episode::Running { elapsed_steps } | Episode::Over { elapsed_steps } => elapsed_steps,
        }
    }

    /// The wrapped environment. There is no mutable access, because a step there would not be
    /// counted.
    #[must_use]
    pub const fn inner(&self) -> &E {
        &self.env
    }

    /// Removes the limit.
    #[must_use]
    pub fn into_inner(self) -> E {
        self.env
    }
}

impl<E: Env> Env for TimeLimit<E> {
    type Observation = E::Observation;
    type Info = E::Info;
    type ActionSpace = E::ActionSpace;
    type ResetOptions = E::ResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        let reset = self.env.reset_with(seed, options)?;
        self.episode = Episode::Running { elapsed_steps: 0 };
        Ok(reset)
    }

    fn step(
        &mut self,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let elapsed_steps = match self.episode {
            Episode::NotStarted => return Err(EnvError::ResetNeeded),
            Episode::Over { .. } => return Err(EnvError::EpisodeOver),
            Episode::Running { elapsed_steps } => elapsed_steps + 1,
        };
        let mut step = self.env.step(action)?;
        step.truncated |= elapsed_steps >= self.max_episode_steps.get();
        self.episode = if step.is_last() {
            Episode::Over { elapsed_steps }
        } else {
            Episode::Running { elapsed_steps }
        };
        Ok(step)
    }

    fn action_space(&self) -> &E::ActionSpace {
        self.env.action_space()
    }

    fn observation_space(&self) -> &Space {
        self.env.observation_space()
    }
}

/// The goals are the wrapped environment's. Its
/// [`compute_truncated`](crate::GoalEnvExt::compute_truncated) ignores the limit, which is
/// not a function of the goals.
impl<E: GoalEnv> GoalEnv for TimeLimit<E> {
    type GoalReward = E::GoalReward;

    fn goal_reward(&self) -> &E::GoalReward {
        self.env.goal_reward()
    }
}

/// Snapshot of a [`TimeLimit`]: the state of the wrapped environment and the steps taken.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TimeLimitSnapshot<T> {
    env: T,
    episode: Episode,
}

impl<E: SnapshotEnv> SnapshotEnv for TimeLimit<E> {
    type Snapshot = TimeLimitSnapshot<E::Snapshot>;

    fn snapshot(&self) -> Self::Snapshot {
        TimeLimitSnapshot { env: self.env.snapshot(), episode: self.episode }
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        let limit = self.max_episode_steps.get();
        let fits = match snapshot.episode {
            Episode::NotStarted => true,
            Episode::Running { elapsed_steps } => elapsed_steps < limit,
            Episode::Over { elapsed_steps } => elapsed_steps <= limit,
        };
        if !fits {
            let reason = format!("it is {:?}, the limit is {limit} steps", snapshot.episode);
            return Err(EnvError::ForeignSnapshot { reason });
        }
        self.env.restore(&snapshot.env)?;
        self.episode = snapshot.episode;
        Ok(())
    }
}
