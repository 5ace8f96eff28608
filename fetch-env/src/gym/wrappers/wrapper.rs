//! The traits of wrappers.

use std::{
    fmt::Debug,
    ops::{Deref, DerefMut},
};

use goal_reward::Symmetry;
use serde::{Serialize, de::DeserializeOwned};

use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::goal::{GoalEnv, Info};
use crate::gym::env::observation::GoalObservation;
use crate::gym::env::{Env, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::Space;

/// A wrapper, which changes the actions, observations, rewards or infos of environments `E`.
///
/// [`env.wrap(wrapper)`](super::EnvExt::wrap) puts an environment into it and gives a
/// [`Wrapped`](super::Wrapped) environment, which is an [`Env`] again. Further traits say what else
/// it is; nothing else needs forwarding:
///
/// | the wrapper implements | the wrapped environment is, if the inner one is |
/// |---|---|
/// | [`KeepsGoals`] or [`GoalWrapper`] | a [`GoalEnv`] |
/// | [`Stateless`] or [`SnapshotWrapper`] | a [`SnapshotEnv`](crate::SnapshotEnv) |
/// | nothing further | a `RenderEnv`, and part of a [`VecEnv`](crate::VecEnv) |
///
/// ```
/// use fetch_env::wrappers::{KeepsGoals, Resetting, Stateless, Wrapper};
/// use fetch_env::{
///     BoxSpace, Env, EnvError, EnvExt, GoalEnvExt, Reset, Space, Step, make_kinematic,
/// };
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
/// let mut env = make_kinematic("FetchPush-v4")?.wrap(Closed)?;
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
    type Info: Clone + Debug + PartialEq + Send;
    /// The space of the actions of the wrapped environment.
    type ActionSpace: ActionSpace;

    /// Prepares the wrapper for `env`, from whose spaces it may make its own.
    /// [`wrap`](super::EnvExt::wrap) calls this before anything else. The default does nothing.
    ///
    /// # Errors
    /// [`SpaceError`](crate::spaces::SpaceError) or another error if `env` cannot be wrapped like
    /// this.
    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let _ = env;
        Ok(())
    }

    /// Resets `env`, and changes the wrapper's own state only if that succeeds. After any later
    /// error [`Wrapped`](super::Wrapped) refuses steps until the next reset.
    ///
    /// # Errors
    /// As [`Env::reset_with`].
    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError>;

    /// Takes one action. After an error that [`Env::step`] does not list as harmless,
    /// [`Wrapped`](super::Wrapped) refuses further steps until a reset.
    ///
    /// # Errors
    /// As [`Env::step`].
    fn step(
        &mut self,
        env: &mut E,
        action: &[<Self::ActionSpace as ActionSpace>::Element],
    ) -> Result<Step<Self::Observation, Self::Info>, EnvError>;

    /// Returns the space of the actions that [`step`](Self::step) expects.
    fn action_space<'a>(&'a self, env: &'a E) -> &'a Self::ActionSpace;

    /// Returns the space of all observations.
    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space;

    /// Returns the wrapper's last observation again, given that of the inner environment: `None` by
    /// default. A wrapper that keeps observations as they are returns `Some(inner)`.
    fn last_observation(&self, inner: E::Observation) -> Option<Self::Observation> {
        let _ = inner;
        None
    }
}

/// The environment that a [`Wrapper`] resets.
///
/// It records whether the environment has begun an episode, or whether anything else may have
/// changed it: if so, the wrapper must begin the episode, too, before [`Wrapped`](super::Wrapped)
/// takes a step.
#[derive(Debug)]
pub struct Resetting<'a, E> {
    env: &'a mut E,
    has_changed: &'a mut bool,
}

impl<'a, E> Resetting<'a, E> {
    pub(super) const fn new(env: &'a mut E, has_changed: &'a mut bool) -> Self {
        Self { env, has_changed }
    }
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

/// A [`Wrapper`] whose environment keeps the law of [`GoalEnv`], with a reward of its own, like
/// [`TransformReward`](super::TransformReward). A wrapper that keeps the environment's reward
/// implements [`KeepsGoals`] instead.
pub trait GoalWrapper<E: GoalEnv>:
    Wrapper<E, Observation: GoalObservation, Info: AsRef<Info>>
{
    /// The reward as a function of the goals.
    type GoalReward: goal_reward::GoalReward;

    /// Returns the reward as a function of the goals.
    fn goal_reward<'a>(&'a self, env: &'a E) -> &'a Self::GoalReward;

    /// Returns the [symmetries](GoalEnv::symmetries) of the wrapped environment: none by default.
    fn symmetries(&self, env: &E) -> Vec<Symmetry> {
        let _ = env;
        Vec::new()
    }
}

/// A [`Wrapper`] that leaves goals, rewards and the ends of episodes as they are, so that the
/// environment's own [`goal_reward`](GoalEnv::goal_reward) still holds: `impl KeepsGoals for Closed
/// {}`, as in the example of [`Wrapper`].
pub trait KeepsGoals {
    /// Whether the environment's [symmetries](GoalEnv::symmetries) hold, too, because the wrapper
    /// changes neither what is observed nor what actions do: false by default.
    const KEEPS_SYMMETRIES: bool = false;
}

impl<E: GoalEnv, W> GoalWrapper<E> for W
where
    W: KeepsGoals + Wrapper<E, Observation: GoalObservation, Info: AsRef<Info>>,
{
    type GoalReward = E::GoalReward;

    fn goal_reward<'a>(&'a self, env: &'a E) -> &'a E::GoalReward {
        env.goal_reward()
    }

    fn symmetries(&self, env: &E) -> Vec<Symmetry> {
        if W::KEEPS_SYMMETRIES { env.symmetries() } else { Vec::new() }
    }
}

/// A [`Wrapper`] whose state can be saved and restored.
///
/// ```
/// use fetch_env::{EnvError, wrappers::SnapshotWrapper};
///
/// /// Counts steps.
/// struct Counter(u64);
///
/// impl SnapshotWrapper for Counter {
///     type State = u64;
///
///     fn state(&self) -> u64 {
///         self.0
///     }
///
///     fn check_state(&self, _state: &u64) -> Result<(), EnvError> {
///         Ok(())
///     }
///
///     fn set_state(&mut self, state: &u64) {
///         self.0 = *state;
///     }
/// }
/// ```
pub trait SnapshotWrapper {
    /// Everything that determines the wrapper's future, exact to the last bit, but not its
    /// settings.
    type State: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the current state.
    fn state(&self) -> Self::State;

    /// Checks a state before anything is restored.
    ///
    /// # Errors
    /// [`EnvError::ForeignSnapshot`] if it is from another wrapper.
    fn check_state(&self, state: &Self::State) -> Result<(), EnvError>;

    /// Restores a state that has passed the [check](Self::check_state).
    fn set_state(&mut self, state: &Self::State);
}

/// A [`Wrapper`] whose results depend on nothing but its settings and the environment: `impl
/// Stateless for Closed {}`, as in the example of [`Wrapper`].
pub trait Stateless {}

impl<W: Stateless> SnapshotWrapper for W {
    type State = ();

    fn state(&self) {}

    fn check_state(&self, (): &()) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, (): &()) {}
}
