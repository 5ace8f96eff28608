//! The errors of environments, of their settings and spaces, and of environments stepped together.

use std::{error::Error, sync::Arc};

use fetch_sim::{SimError, Task};
use goal_reward::ThresholdError;

use crate::env_id::UnknownEnvId;

/// Error returned when an environment cannot be made, reset, stepped or restored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvError {
    /// A step before the first reset, or after a failure.
    #[error("the environment has not been reset: call reset() before step()")]
    ResetNeeded,
    /// A step after the end of the episode.
    #[error("the episode is over (terminated or truncated): call reset() before the next step()")]
    EpisodeOver,
    /// An action of the wrong length.
    #[error("the action has {actual} elements: pass {expected}, as many as the action space has")]
    ActionLength {
        /// Number of elements of the action space.
        expected: usize,
        /// Number of elements of the action.
        actual: usize,
    },
    /// An element of the action is NaN or infinite.
    #[error(
        "action[{index}] is {value}: pass finite numbers; finite ones are clipped to the action space"
    )]
    ActionNotFinite {
        /// Index of the element.
        index: usize,
        /// Value of the element.
        value: f32,
    },
    /// A number in the reset options is NaN or infinite.
    #[error(
        "the reset option {option} is {value} at index {index}: pass finite numbers, in meters"
    )]
    OptionNotFinite {
        /// Name of the option.
        option: &'static str,
        /// Index of the element.
        index: usize,
        /// Value of the element.
        value: f64,
    },
    /// A snapshot of another environment.
    #[error(
        "the snapshot does not fit this environment ({reason}): restore it into one made the same way"
    )]
    ForeignSnapshot {
        /// The difference between the two.
        reason: String,
    },
    /// A simulator made from other settings than the configuration's.
    #[error(
        "the simulator does not fit the configuration ({reason}): make it from the configuration's sim()"
    )]
    SimulatorMismatch {
        /// The difference between the two.
        reason: String,
    },
    /// The operating system gave no random seed.
    #[error("the operating system gave no random seed ({reason}): pass one to reset()")]
    Entropy {
        /// The operating system's message.
        reason: String,
    },
    /// The simulator failed.
    #[error(transparent)]
    Sim(SimError),
    /// The environment panicked while a [`VecEnv`](crate::VecEnv) stepped it.
    #[error("the environment panicked ({message}) and is out of use: make new environments")]
    Panicked {
        /// The message of the panic.
        message: String,
    },
    /// The environment could not be rendered.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Render(#[from] fetch_sim::RenderError),
    /// The settings are invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The observations cannot be extended, because their space has the new key already.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// No environment has this name.
    #[error(transparent)]
    UnknownId(#[from] UnknownEnvId),
    /// The environments cannot be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// An environment of another crate failed; see [`other`](Self::other).
    #[error(transparent)]
    Other(OtherError),
}

/// The error of an environment that is not one of this crate.
///
/// Two of them are equal if they have the same message.
#[derive(Clone, Debug, thiserror::Error)]
#[error(transparent)]
pub struct OtherError(Arc<dyn Error + Send + Sync>);

impl PartialEq for OtherError {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_string() == other.0.to_string()
    }
}

impl EnvError {
    /// Wraps the error of an environment that is not one of this crate: an error or a message. The
    /// environment must be reset afterwards.
    ///
    /// ```
    /// use fetch_env::EnvError;
    ///
    /// let error = EnvError::other("the robot lost its connection: check the cable");
    /// assert_eq!(error.to_string(), "the robot lost its connection: check the cable");
    /// ```
    pub fn other(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Other(OtherError(Arc::from(error.into())))
    }

    /// Whether a step refused with this error has changed nothing; see
    /// [`Env::step`](crate::Env::step).
    pub(crate) const fn leaves_unchanged(&self) -> bool {
        matches!(
            self,
            Self::ActionLength { .. }
                | Self::ActionNotFinite { .. }
                | Self::ResetNeeded
                | Self::EpisodeOver
        )
    }
}

impl From<SimError> for EnvError {
    fn from(error: SimError) -> Self {
        match error {
            // One variant to match on, whichever layer finds the difference.
            SimError::ForeignSnapshot { reason } => Self::ForeignSnapshot { reason },
            error => Self::Sim(error),
        }
    }
}

/// Error returned for invalid settings of a Fetch environment.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// A setting of the object in a task without one.
    #[error("{task} has no object, so {option} cannot be set: leave it out")]
    NoObject {
        /// The task.
        task: Task,
        /// Name of the setting.
        option: &'static str,
    },
    /// A range from which nothing can be drawn.
    #[error("{option} is {value}: pass a finite number of meters, at least {least}")]
    Range {
        /// Name of the setting.
        option: &'static str,
        /// Its value, in meters.
        value: f64,
        /// The smallest valid value, in meters.
        least: f64,
    },
    /// An offset that is NaN or infinite.
    #[error("target_offset[{axis}] is {value}: pass a finite number of meters")]
    Offset {
        /// Index of the axis: x, y, z.
        axis: usize,
        /// The offset, in meters.
        value: f64,
    },
    /// A distance threshold that is negative or not finite.
    #[error(transparent)]
    Threshold(#[from] ThresholdError),
    /// A count that must not be zero.
    #[error("{option} is 0: pass at least 1")]
    Zero {
        /// Name of the setting.
        option: &'static str,
    },
}

/// Error returned for an invalid space.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SpaceError {
    /// The number of bounds does not match the shape.
    #[error(
        "a box of shape {shape:?} has {low} lower and {high} upper bounds: pass {expected} each"
    )]
    BoundCount {
        /// The shape.
        shape: Vec<usize>,
        /// Number of elements of that shape.
        expected: usize,
        /// Number of lower bounds.
        low: usize,
        /// Number of upper bounds.
        high: usize,
    },
    /// No number lies between the bounds of an element.
    #[error(
        "element {index} of the box has no number between {low} and {high}: pass low <= high, neither NaN"
    )]
    EmptyInterval {
        /// Index of the element, row-major.
        index: usize,
        /// Lower bound of the element.
        low: f64,
        /// Upper bound of the element.
        high: f64,
    },
    /// A slice for a sample has the wrong length.
    #[error(
        "the slice for a sample has {actual} elements: pass {expected}, as many as the space has"
    )]
    SampleLength {
        /// Number of elements of the space.
        expected: usize,
        /// Number of elements of the slice.
        actual: usize,
    },
    /// Two spaces of a dictionary have the same key.
    #[error("the key {key:?} occurs twice: name each space of a dictionary differently")]
    DuplicateKey {
        /// The key.
        key: String,
    },
}

/// Error returned when a [`VecEnv`](crate::VecEnv) cannot be made or a call is invalid.
///
/// The call has then changed nothing. A failure of a single environment is not such an error: see
/// [`Batch::error`](crate::vec_env::Batch::error).
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum VecEnvError {
    /// No environment was passed.
    #[error("there is no environment: pass at least one")]
    NoEnvs,
    /// The spaces of an environment differ from the first one's.
    #[error("environment {env_id} has other spaces than environment 0: make all of them alike")]
    SpacesDiffer {
        /// Id of the environment.
        env_id: usize,
    },
    /// The observation space is not that of a goal-conditioned environment.
    #[error(
        "the observation space has no box of f64 named {key:?}: pass environments that observe \
         observation, achieved_goal and desired_goal"
    )]
    NoGoalSpace {
        /// Key of the missing part.
        key: &'static str,
    },
    /// Too many or too few actions.
    #[error(
        "{actual} numbers are not {rows} actions of {action_len}: pass one row per environment"
    )]
    ActionCount {
        /// Number of actions needed.
        rows: usize,
        /// Number of elements of an action.
        action_len: usize,
        /// Number of elements passed.
        actual: usize,
    },
    /// No environment has this id.
    #[error("there is no environment {env_id}: pass ids from 0 to {}", num_envs - 1)]
    UnknownEnv {
        /// The id.
        env_id: usize,
        /// Number of environments.
        num_envs: usize,
    },
    /// The environment is in flight, or named twice in one call.
    #[error(
        "environment {env_id} is in flight: send to it once, and again after recv() returns it"
    )]
    EnvInFlight {
        /// Id of the environment.
        env_id: usize,
    },
    /// A call for all environments while some are in flight.
    #[error("{count} environments are in flight: recv() them before step() or reset()")]
    InFlight {
        /// Number of environments in flight.
        count: usize,
    },
    /// A batch larger than the number of environments in flight.
    #[error(
        "a batch of {batch_size} can never be complete: ask for at most the {in_flight} in flight"
    )]
    BatchTooLarge {
        /// Size of the batch.
        batch_size: usize,
        /// Number of environments in flight.
        in_flight: usize,
    },
    /// Seeds or a mask for another number of environments.
    #[error("{what} has {actual} elements for {num_envs} environments: pass one for each")]
    Count {
        /// `seeds` or `mask`.
        what: &'static str,
        /// Number of elements passed.
        actual: usize,
        /// Number of environments.
        num_envs: usize,
    },
    /// A mask that selects no environment.
    #[error("the mask resets no environment: set at least one element")]
    EmptyMask,
    /// The seed of the last environment exceeds 64 bits.
    #[error(
        "the seeds from {first} on for {num_envs} environments exceed 64 bits: pass a smaller one"
    )]
    SeedTooLarge {
        /// Seed of the first environment.
        first: u64,
        /// Number of environments.
        num_envs: usize,
    },
    /// The operating system could not start a thread.
    #[error("a worker thread could not be started ({reason}): use fewer threads")]
    Thread {
        /// The operating system's message.
        reason: String,
    },
    /// This system cannot pin threads.
    #[error("the threads cannot be pinned to cores on this system: leave pin_threads off")]
    Pinning,
    /// A worker thread died, and an environment with it.
    #[error("a worker thread died: make new environments")]
    WorkerLost,
}
