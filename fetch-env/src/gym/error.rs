//! The errors of environments.

use std::{error::Error, sync::Arc};

use fetch_sim::SimError;

use super::{
    registry::RegistryError, spaces::error::SpaceError, vec_env::error::VecEnvError,
    wrappers::error::WrapperError,
};
use crate::fetch::{env_id::UnknownEnvId, error::ConfigError};

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
    /// An episode that whoever runs it has given up.
    #[error("the episode has not ended after {steps} steps: wrap the environment with TimeLimit")]
    Endless {
        /// The number of steps.
        steps: usize,
    },
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
        value: f64,
    },
    /// An element of the action is not one of the choices.
    #[error("action[{index}] is {value}: pass an integer from {first} to {last}")]
    ActionOutside {
        /// Index of the element.
        index: usize,
        /// Value of the element.
        value: i64,
        /// The smallest choice.
        first: i64,
        /// The largest choice.
        last: i64,
    },
    /// An observation that does not have the shape of its space.
    #[error(
        "the {key} has {actual} elements, its space {expected}: let observation_space() describe \
         what the environment observes"
    )]
    ObservationLength {
        /// Key of the part.
        key: &'static str,
        /// Number of elements in the space.
        expected: usize,
        /// Number of elements of the observation.
        actual: usize,
    },
    /// A number in the reset options is NaN or too large.
    #[error(
        "the reset option {option} is {value} at index {index}: pass numbers from -{most} to {most}"
    )]
    OptionOutside {
        /// Name of the option.
        option: &'static str,
        /// Index of the element.
        index: usize,
        /// Value of the element.
        value: f64,
        /// The largest valid value.
        most: f64,
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
    /// A video could not be recorded.
    #[cfg(all(feature = "clip", feature = "render"))]
    #[error(transparent)]
    Video(#[from] crate::pictures::clip::video_options::VideoError),
    /// The settings are invalid.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The observations cannot be extended, because their space has the new key already.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// The environment cannot be wrapped like this.
    #[error(transparent)]
    Wrapper(#[from] WrapperError),
    /// No environment has this name.
    #[error(transparent)]
    UnknownId(#[from] UnknownEnvId),
    /// A registry has no environment of this name.
    #[error(transparent)]
    Registry(#[from] RegistryError),
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
                | Self::ActionOutside { .. }
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
