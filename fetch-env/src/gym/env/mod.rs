//! Environments in general: resets, steps and snapshots.

pub(crate) mod action_space;
mod boxed;
pub(crate) mod goal;
pub(crate) mod observation;

use std::fmt::Debug;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use self::action_space::ActionSpace;
use crate::gym::error::EnvError;
use crate::gym::spaces::{Space, error::SpaceError};

/// An environment: it is reset, takes actions, and returns observations and rewards.
///
/// The semantics are those of Gymnasium's `Env`, with errors instead of exceptions and silent
/// misbehavior. One value is one environment; several can run on several threads.
///
/// ```
/// use fetch_env::{BoxSpace, Env, EnvError, make_kinematic};
///
/// /// Sums the rewards of an episode in which the robot stands still.
/// fn idle_return(mut env: impl Env<ActionSpace = BoxSpace<f32>>) -> Result<f64, EnvError> {
///     env.reset(Some(0))?;
///     let mut episode_return = 0.0;
///     loop {
///         let step = env.step(&[0.0; 4])?;
///         episode_return += step.reward;
///         if step.is_last() {
///             return Ok(episode_return);
///         }
///     }
/// }
/// assert_eq!(idle_return(make_kinematic("FetchPush-v4")?)?, -50.0);
/// # Ok::<(), EnvError>(())
/// ```
pub trait Env {
    /// An observation: an owned value, never a view of state that later steps change.
    type Observation: Clone + Debug + PartialEq;
    /// Diagnostic information, not meant for learning.
    type Info: Clone + Debug + PartialEq + Send;
    /// The space of the actions: [`BoxSpace<f32>`](crate::BoxSpace) in the Fetch tasks.
    type ActionSpace: ActionSpace;
    /// Options of a reset.
    type ResetOptions: Clone + Default + Send;

    /// Starts a new episode: [`reset_with`](Self::reset_with) with default options.
    ///
    /// # Errors
    /// As [`reset_with`](Self::reset_with).
    fn reset(
        &mut self,
        seed: Option<u64>,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError> {
        self.reset_with(seed, &Self::ResetOptions::default())
    }

    /// Starts a new episode, whether or not the last one is over.
    ///
    /// A seed and the actions determine everything that follows. Without a seed the stream of
    /// random numbers continues from the last episode; before the first episode the operating
    /// system provides a seed.
    ///
    /// # Errors
    /// Rejects invalid options before anything changes. After any other error the environment must
    /// be reset.
    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &Self::ResetOptions,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError>;

    /// Takes one action.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before the first reset, [`EnvError::EpisodeOver`] after the end of
    /// the episode, and the errors of [`ActionSpace::check_action`]. None of these changes
    /// anything. After any other error the environment must be reset.
    fn step(
        &mut self,
        action: &[<Self::ActionSpace as ActionSpace>::Element],
    ) -> Result<Step<Self::Observation, Self::Info>, EnvError>;

    /// Returns the space of the actions that [`step`](Self::step) expects.
    fn action_space(&self) -> &Self::ActionSpace;

    /// Returns the space of all observations.
    fn observation_space(&self) -> &Space;
}

/// An element of an environment's actions.
pub type ActionElement<E> = <<E as Env>::ActionSpace as ActionSpace>::Element;

/// Result of a reset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reset<O, I> {
    /// First observation of the episode.
    pub observation: O,
    /// Diagnostic information returned with the observation.
    pub info: I,
}

impl<O, I> Reset<O, I> {
    /// Replaces the observation with the result of `map`.
    ///
    /// # Errors
    /// The error of `map`.
    pub fn try_map_observation<P, X>(
        self,
        map: impl FnOnce(O) -> Result<P, X>,
    ) -> Result<Reset<P, I>, X> {
        let Self { observation, info } = self;
        Ok(Reset { observation: map(observation)?, info })
    }

    /// Replaces the info with the result of `map`.
    pub fn map_info<J>(self, map: impl FnOnce(I) -> J) -> Reset<O, J> {
        let Self { observation, info } = self;
        Reset { observation, info: map(info) }
    }
}

/// Result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step<O, I> {
    /// Observation after the action.
    pub observation: O,
    /// Reward of the action.
    pub reward: f64,
    /// Whether the task itself has ended: no reward can follow, so learners must not bootstrap.
    pub terminated: bool,
    /// Whether the episode was cut off for a reason outside the task, such as a time limit;
    /// learners bootstrap from the value of the last observation.
    pub truncated: bool,
    /// Diagnostic information returned with the observation.
    pub info: I,
}

impl<O, I> Step<O, I> {
    /// Whether the episode is over, for either reason.
    #[must_use]
    pub const fn is_last(&self) -> bool {
        self.terminated || self.truncated
    }

    /// Replaces the observation with the result of `map`.
    ///
    /// # Errors
    /// The error of `map`.
    pub fn try_map_observation<P, X>(
        self,
        map: impl FnOnce(O) -> Result<P, X>,
    ) -> Result<Step<P, I>, X> {
        let Self { observation, reward, terminated, truncated, info } = self;
        Ok(Step { observation: map(observation)?, reward, terminated, truncated, info })
    }

    /// Replaces the info with the result of `map`.
    pub fn map_info<J>(self, map: impl FnOnce(I) -> J) -> Step<O, J> {
        let Self { observation, reward, terminated, truncated, info } = self;
        Step { observation, reward, terminated, truncated, info: map(info) }
    }
}

/// An environment whose complete state can be saved and restored.
///
/// ```
/// use fetch_env::{Env, SnapshotEnv, make_kinematic};
///
/// let mut env = make_kinematic("FetchPush-v4")?;
/// env.reset(Some(0))?;
/// let snapshot = env.snapshot();
/// let step = env.step(&[0.5; 4])?;
/// env.restore(&snapshot)?;
/// assert_eq!(env.step(&[0.5; 4])?, step);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait SnapshotEnv: Env {
    /// Everything that determines the environment's future, exact to the last bit.
    type Snapshot: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the current state.
    fn snapshot(&self) -> Self::Snapshot;

    /// Restores a snapshot of this environment or of one made the same way. Afterwards the same
    /// actions give the same results, bit for bit, and so do later resets without a seed.
    ///
    /// # Errors
    /// [`EnvError::ForeignSnapshot`] if the snapshot is from another environment; this one is then
    /// unchanged.
    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError>;

    /// Returns the observation of the last reset or step, or of the restored snapshot; `None`
    /// before a reset, after a failure, and, by default, always.
    fn last_observation(&self) -> Option<Self::Observation> {
        None
    }
}

/// Snapshot of an environment and of what contains it: a wrapper with the state `T`, or a
/// [`VecEnv`](crate::VecEnv), which counts the environment's episodes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WrappedSnapshot<S, T> {
    pub(crate) env: S,
    pub(crate) wrapper: T,
    pub(crate) reset_needed: bool,
}

impl<S, T> WrappedSnapshot<S, T> {
    /// Returns the snapshot of the environment inside.
    #[must_use]
    pub const fn inner(&self) -> &S {
        &self.env
    }
}

impl From<SpaceError> for EnvError {
    fn from(error: SpaceError) -> Self {
        Self::other(error)
    }
}
