//! What an environment is.

pub(crate) mod goal;
pub(crate) mod time_limit;

use std::fmt::Debug;

use serde::{Deserialize, Serialize, de::DeserializeOwned};

use crate::{BoxSpace, EnvError, Space};

/// An environment: something that is reset, then takes actions and gives observations and rewards.
///
/// The semantics are those of Gymnasium's `Env`, with errors where Gymnasium has exceptions or
/// silence. One value is one environment; several may run on several threads.
pub trait Env {
    /// What is observed. A value of its own, never a view of what later steps change.
    type Observation: Clone + Debug + PartialEq;
    /// What is told besides, for diagnosis and not for learning.
    type Info: Clone + Debug + PartialEq;
    /// What can be asked of a reset.
    type ResetOptions: Default;

    /// Starts a new episode, as [`reset_with`](Self::reset_with) without any wish.
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
    /// With a seed, everything that follows is decided by it and by the actions. Without one, the
    /// random numbers go on from the last episode; if there was none, the operating system gives a
    /// seed.
    ///
    /// # Errors
    /// Options that cannot be met are refused before anything changes. After any other error a
    /// reset is needed.
    fn reset_with(
        &mut self,
        seed: Option<u64>,
        options: &Self::ResetOptions,
    ) -> Result<Reset<Self::Observation, Self::Info>, EnvError>;

    /// Takes one action.
    ///
    /// # Errors
    /// [`EnvError::ResetNeeded`] before the first reset and [`EnvError::EpisodeOver`] after the
    /// episode's end; [`EnvError::ActionLength`] or [`EnvError::ActionNotFinite`] if the action is
    /// none. In these cases nothing has changed. After any other error a reset is needed.
    fn step(&mut self, action: &[f32]) -> Result<Step<Self::Observation, Self::Info>, EnvError>;

    /// The actions that [`step`](Self::step) is made for.
    fn action_space(&self) -> &BoxSpace<f32>;

    /// The space of all observations.
    fn observation_space(&self) -> &Space;
}

/// What a reset gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reset<O, I> {
    /// The first observation of the episode.
    pub observation: O,
    /// What is told besides.
    pub info: I,
}

/// What a step gives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Step<O, I> {
    /// What the action led to.
    pub observation: O,
    /// The reward of the action.
    pub reward: f64,
    /// Whether the task itself has ended: no reward can follow, so nothing is to be bootstrapped.
    pub terminated: bool,
    /// Whether the episode was cut off for a reason outside the task, such as a time limit; the
    /// value of the last observation is still to be bootstrapped.
    pub truncated: bool,
    /// What is told besides.
    pub info: I,
}

impl<O, I> Step<O, I> {
    /// Whether the episode is over, for either reason.
    #[must_use]
    pub const fn is_last(&self) -> bool {
        self.terminated || self.truncated
    }
}

/// An environment whose complete state can be kept and gone back to.
pub trait SnapshotEnv: Env {
    /// Everything that decides how the environment goes on, exact to the last bit.
    type Snapshot: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// The present state.
    fn snapshot(&self) -> Self::Snapshot;

    /// Goes back to a snapshot, taken from this environment or from one made the same way. The same
    /// actions then give the same results as they did there, bit for bit, and so do later resets
    /// without a seed.
    ///
    /// # Errors
    /// [`EnvError::ForeignSnapshot`] if the snapshot is of another environment; this one is then
    /// unchanged.
    fn restore(&mut self, snapshot: &Self::Snapshot) -> Result<(), EnvError>;
}
