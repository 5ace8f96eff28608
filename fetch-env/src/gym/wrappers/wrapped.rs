//! A wrapped environment, and what a wrapper says about its part in it.

use std::{
    fmt::Debug,
    ops::{Deref, DerefMut},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::gym::env::goal::{GoalEnv, GoalInfo};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{Env, Reset, SnapshotEnv, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::{Space, action_space::ActionSpace};

/// The part of a [`Wrapped`] environment that is not the environment itself.
///
/// A type that implements this trait is a wrapper of environments `E`: [`Wrapped`] turns it and an
/// environment into an [`Env`]. Further traits say what else the wrapped environment is, and nothing
/// else has to be forwarded:
///
/// | the wrapper implements | then the wrapped environment is, where the inner one is |
/// |---|---|
/// | [`KeepsGoals`] or [`GoalWrapper`] | a [`GoalEnv`] |
/// | [`Stateless`] or [`SnapshotWrapper`] | a [`SnapshotEnv`] |
/// | nothing further | a `RenderEnv`, and part of a [`VecEnv`](crate::VecEnv) |
///
/// ```
/// use fetch_env::wrappers::{KeepsGoals, Resetting, Stateless, Wrapped, Wrapper};
/// use fetch_env::{BoxSpace, Env, EnvError, GoalEnvExt, Reset, Space, Step, make_kinematic};
///
/// /// Holds the fingers closed, whatever the action says.
/// struct Closed;
///
/// impl<E: Env<ActionSpace = BoxSpace<f32>>> Wrapper<E> for Closed {
///     type Observation = E::Observation;
///     type Info = E::Info;
///     type ActionSpace = E::ActionSpace;
///
///     fn reset(
///         &mut self,
///         env: &mut Resetting<'_, E>,
///         seed: Option<u64>,
///         options: &E::ResetOptions,
///     ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
///         env.reset_with(seed, options)
///     }
///
///     fn step(
///         &mut self,
///         env: &mut E,
///         action: &[f32],
///     ) -> Result<Step<E::Observation, E::Info>, EnvError> {
///         match action {
///             &[x, y, z, _] => env.step(&[x, y, z, -1.0]),
///             wrong => env.step(wrong),
///         }
///     }
///
///     fn action_space<'a>(&'a self, env: &'a E) -> &'a BoxSpace<f32> {
///         env.action_space()
///     }
///
///     fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
///         env.observation_space()
///     }
/// }
///
/// impl KeepsGoals for Closed {}
/// impl Stateless for Closed {}
///
/// let mut env = Wrapped::from_parts(make_kinematic("FetchPush-v4")?, Closed);
/// env.reset(Some(0))?;
/// let step = env.step(&[0.0, 0.0, 0.0, 1.0])?;
/// assert_eq!(step.observation.finger_positions(), [0.0; 2]);
/// assert!(env.is_success(&[0.0; 3], &[0.0; 3]));
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait Wrapper<E: Env> {
    /// Observation of the wrapped environment.
    type Observation: Clone + Debug + PartialEq;
    /// Diagnostic information of the wrapped environment.
    type Info: Clone + Debug + PartialEq;
    /// The space of the actions of the wrapped environment.
    type ActionSpace: ActionSpace;

    /// Resets `env`, and changes the wrapper's own state only if that succeeds. After an error that
    /// comes later than that, whichever it is, [`Wrapped`] refuses steps until the next reset.
    ///
    /// # Errors
    /// As [`Env::reset_with`].
    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError>;

    /// Takes one action. After an error that [`Env::step`] does not list as harmless, [`Wrapped`]
    /// refuses further steps until a reset.
    ///
    /// # Errors
    /// As [`Env::step`].
    fn step(
        &mut self,
        env: &mut E,
        action: &[<Self::ActionSpace as ActionSpace>::Element],
    ) -> Result<Step<Self::Observation, Self::Info>, EnvError>;

    /// The space of the actions that [`step`](Self::step) expects.
    fn action_space<'a>(&'a self, env: &'a E) -> &'a Self::ActionSpace;

    /// The space of all observations.
    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space;
}

/// The environment that a [`Wrapper`] resets.
///
/// It notes whether the environment has begun an episode, or whether anything else may have changed
/// it: then the wrapper has to begin the episode, too, before [`Wrapped`] takes a step.
#[derive(Debug)]
pub struct Resetting<'a, E> {
    env: &'a mut E,
    has_changed: &'a mut bool,
}

impl<E: Env> Resetting<'_, E> {
    /// Resets the environment.
    ///
    /// # Errors
    /// As [`Env::reset_with`].
    pub fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        // After a failure the environment itself knows whether it must be reset.
        let reset = self.env.reset_with(seed, options)?;
        *self.has_changed = true;
        Ok(reset)
    }
}

impl<E> Deref for Resetting<'_, E> {
    type Target = E;

    fn deref(&self) -> &E {
        self.env
    }
}

impl<E> DerefMut for Resetting<'_, E> {
    fn deref_mut(&mut self) -> &mut E {
        *self.has_changed = true;
        self.env
    }
}

/// A [`Wrapper`] whose environment keeps the law of [`GoalEnv`], with a reward of its own.
pub trait GoalWrapper<E: GoalEnv>:
    Wrapper<E, Observation: GoalObservation, Info: GoalInfo>
{
    /// The reward as a function of the goals.
    type GoalReward: goal_reward::GoalReward;

    /// The reward as a function of the goals.
    fn goal_reward<'a>(&'a self, env: &'a E) -> &'a Self::GoalReward;
}

/// A [`Wrapper`] that leaves goals, rewards and the ends of episodes as they are, so that the
/// environment's own [`goal_reward`](GoalEnv::goal_reward) still holds.
pub trait KeepsGoals {}

impl<E: GoalEnv, W> GoalWrapper<E> for W
where
    W: KeepsGoals + Wrapper<E, Observation: GoalObservation, Info: GoalInfo>,
{
    type GoalReward = E::GoalReward;

    fn goal_reward<'a>(&'a self, env: &'a E) -> &'a E::GoalReward {
        env.goal_reward()
    }
}

/// A [`Wrapper`] whose state can be saved and restored.
pub trait SnapshotWrapper {
    /// Everything that decides the wrapper's future, exact to the last bit; not its settings.
    type State: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the current state.
    fn state(&self) -> Self::State;

    /// Checks a state before anything is restored.
    ///
    /// # Errors
    /// [`EnvError::ForeignSnapshot`] if it is of another wrapper.
    fn check_state(&self, state: &Self::State) -> Result<(), EnvError>;

    /// Restores a state that has passed the [check](Self::check_state).
    fn set_state(&mut self, state: &Self::State);
}

/// A [`Wrapper`] whose results depend on nothing but its settings and the environment.
pub trait Stateless {}

impl<W: Stateless> SnapshotWrapper for W {
    type State = ();

    fn state(&self) {}

    fn check_state(&self, (): &()) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, (): &()) {}
}

/// An environment in a wrapper; see [`Wrapper`] for writing one and the [module](super) for those
/// that exist.
#[derive(Clone, Debug)]
pub struct Wrapped<E, W> {
    env: E,
    pub(super) wrapper: W,
    /// Whether a step has failed in the wrapper or below, or a reset in the wrapper alone.
    reset_needed: bool,
}

impl<E, W> Wrapped<E, W> {
    /// Wraps `env`, which must be reset before its next step.
    #[must_use]
    pub const fn from_parts(env: E, wrapper: W) -> Self {
        Self { env, wrapper, reset_needed: false }
    }

    /// The wrapped environment. There is no mutable access, because the wrapper would miss a step
    /// there.
    #[must_use]
    pub const fn inner(&self) -> &E {
        &self.env
    }

    /// The wrapper without the environment.
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
        let mut env = Resetting { env: &mut self.env, has_changed: &mut self.reset_needed };
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
}

/// Snapshot of a [`Wrapped`] environment: the states of the environment and of the wrapper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrappedSnapshot<S, T> {
    env: S,
    wrapper: T,
    reset_needed: bool,
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
}
