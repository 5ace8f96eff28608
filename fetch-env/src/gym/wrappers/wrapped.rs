//! An environment in a wrapper.

use goal_reward::Symmetry;

use super::wrapper::{GoalWrapper, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::goal::{GoalEnv, MovingGoal};
use crate::gym::env::{Env, Reset, SnapshotEnv, Step, WrappedSnapshot};
use crate::gym::error::EnvError;
use crate::gym::spaces::Space;

/// Wraps environments. Every [`Env`] implements it.
pub trait EnvExt: Env + Sized {
    /// Wraps this environment, which must be reset before its next step.
    ///
    /// ```
    /// use fetch_env::{Env, EnvExt, make_kinematic};
    /// use fetch_env::wrappers::{ClipAction, RecordEpisodeStatistics};
    ///
    /// let env = make_kinematic("FetchReach-v4")?;
    /// let mut env = env.wrap(ClipAction::new())?.wrap(RecordEpisodeStatistics::new())?;
    /// env.reset(Some(0))?;
    /// env.step(&[9.0, 0.0, 0.0, 0.0])?;
    /// # Ok::<(), fetch_env::EnvError>(())
    /// ```
    ///
    /// # Errors
    /// As [`Wrapper::attach`]: the wrapper says which environments it takes.
    fn wrap<W: Wrapper<Self>>(self, mut wrapper: W) -> Result<Wrapped<Self, W>, EnvError> {
        wrapper.attach(&self)?;
        Ok(Wrapped::attached(self, wrapper))
    }
}

impl<E: Env> EnvExt for E {}

/// An environment in a wrapper, made by [`wrap`](EnvExt::wrap).
#[derive(Clone, Debug)]
pub struct Wrapped<E, W> {
    env: E,
    pub(super) wrapper: W,
    /// Whether a reset is needed: before the first one, after a failed step of the wrapper or of
    /// the environment, and after a reset that failed only in the wrapper.
    reset_needed: bool,
}

impl<E, W> Wrapped<E, W> {
    /// Joins an environment and a wrapper that is attached to it.
    pub(crate) const fn attached(env: E, wrapper: W) -> Self {
        Self { env, wrapper, reset_needed: true }
    }

    /// Returns the wrapped environment. There is no mutable access, because the wrapper would miss
    /// a step there.
    #[must_use]
    pub const fn inner(&self) -> &E {
        &self.env
    }

    /// Returns the wrapper without the environment.
    #[must_use]
    pub const fn wrapper(&self) -> &W {
        &self.wrapper
    }

    #[cfg(all(feature = "clip", feature = "render"))]
    pub(crate) const fn wrapper_mut(&mut self) -> &mut W {
        &mut self.wrapper
    }

    /// Removes the wrapper.
    #[must_use]
    pub fn into_inner(self) -> E {
        self.env
    }
}

impl<E: Env, W: Wrapper<E>> Env for Wrapped<E, W> {
    type Observation = W::Observation;
    type Info = W::Info;
    type ActionSpace = W::ActionSpace;
    type ResetOptions = E::ResetOptions;

    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<W::Observation, W::Info>, EnvError> {
        let mut env = Resetting::new(&mut self.env, &mut self.reset_needed);
        let reset = self.wrapper.reset(&mut env, seed, options)?;
        self.reset_needed = false;
        Ok(reset)
    }

    fn step(
        &mut self,
        action: &[<W::ActionSpace as ActionSpace>::Element],
    ) -> Result<Step<W::Observation, W::Info>, EnvError> {
        if self.reset_needed {
            return Err(EnvError::ResetNeeded);
        }
        let step = self.wrapper.step(&mut self.env, action);
        self.reset_needed = step.as_ref().is_err_and(|error| !error.leaves_unchanged());
        step
    }

    fn action_space(&self) -> &W::ActionSpace {
        self.wrapper.action_space(&self.env)
    }

    fn observation_space(&self) -> &Space {
        self.wrapper.observation_space(&self.env)
    }
}

impl<E: GoalEnv, W: GoalWrapper<E>> GoalEnv for Wrapped<E, W> {
    type GoalReward = W::GoalReward;

    fn goal_reward(&self) -> &W::GoalReward {
        self.wrapper.goal_reward(&self.env)
    }

    fn symmetries(&self) -> Vec<Symmetry> {
        self.wrapper.symmetries(&self.env)
    }
}

impl<E: MovingGoal, W> MovingGoal for Wrapped<E, W> {
    fn set_desired_goal(&mut self, desired_goal: &[f64]) -> Result<(), EnvError> {
        self.env.set_desired_goal(desired_goal)
    }
}

impl<E: SnapshotEnv, W: Wrapper<E> + SnapshotWrapper> SnapshotEnv for Wrapped<E, W> {
    type Snapshot = WrappedSnapshot<E::Snapshot, W::State>;

    fn snapshot(&self) -> Self::Snapshot {
        WrappedSnapshot {
            env: self.env.snapshot(),
            wrapper: self.wrapper.state(),
            reset_needed: self.reset_needed,
        }
    }

    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError> {
        self.wrapper.check_state(&snapshot.wrapper)?;
        self.env.restore(&snapshot.env)?;
        self.wrapper.set_state(&snapshot.wrapper);
        self.reset_needed = snapshot.reset_needed;
        Ok(())
    }

    fn last_observation(&self) -> Option<W::Observation> {
        self.wrapper.last_observation(self.env.last_observation()?)
    }
}
