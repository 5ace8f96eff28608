//! The errors of environments.

use std::{error::Error, sync::Arc};

use super::{
    spaces::error::SpaceError, vec_env::error::VecEnvError, wrappers::error::WrapperError,
};

/// Error returned when an environment cannot be reset, stepped, restored or wrapped.
#[derive(Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvError {
    /// A step before the first reset, or after a failure.
    #[error("the environment has not been reset: call reset() before step()")]
    ResetNeeded,
    /// A step after the end of the episode.
    #[error("the episode is over (terminated or truncated): call reset() before the next step()")]
    EpisodeOver,
    /// The caller gave up on an episode that never ended.
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
        "action[{index}] is {value}: pass finite numbers; finite ones are clipped to the action \
         space"
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
        "the snapshot does not fit this environment ({reason}): restore it into one made the same \
         way"
    )]
    ForeignSnapshot {
        /// The difference between the two.
        reason: String,
    },
    /// The operating system gave no random seed.
    #[error("the operating system gave no random seed ({reason}): pass one to reset()")]
    Entropy {
        /// The operating system's message.
        reason: String,
    },
    /// The environment panicked while a [`VecEnv`](crate::VecEnv) stepped it.
    #[error("the environment panicked ({message}) and is out of use: make new environments")]
    Panicked {
        /// The message of the panic.
        message: String,
    },
    /// The observations cannot be extended, because their space has the new key already.
    #[error(transparent)]
    Space(#[from] SpaceError),
    /// The environment cannot be wrapped like this.
    #[error(transparent)]
    Wrapper(#[from] WrapperError),
    /// The environments cannot be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// What this environment runs on failed, such as its simulator; see
    /// [`downcast_ref`](Self::downcast_ref).
    #[error(transparent)]
    Other(OtherError),
}

debug_as_display!(EnvError);

/// An error that only some environments have.
///
/// Two of them are equal if they have the same message.
#[derive(Clone, thiserror::Error)]
#[error(transparent)]
pub struct OtherError(Arc<dyn Error + Send + Sync>);

debug_as_display!(OtherError);

impl PartialEq for OtherError {
    fn eq(&self, other: &Self) -> bool {
        self.0.to_string() == other.0.to_string()
    }
}

impl EnvError {
    /// Wraps an error that only some environments have: an error or a message. The environment must
    /// be reset afterwards.
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

    /// Returns the error that [`other`](Self::other) wrapped, if it is a `T`.
    ///
    /// A Fetch environment wraps [`SimError`](crate::SimError) if its simulator fails,
    /// [`MakeError`](crate::MakeError), and with pictures `RenderError` and `VideoError`.
    ///
    /// ```
    /// use fetch_env::{EnvError, SimError};
    ///
    /// let error = EnvError::from(SimError::BuiltWithoutMujoco);
    /// assert_eq!(error.downcast_ref(), Some(&SimError::BuiltWithoutMujoco));
    /// assert_eq!(EnvError::ResetNeeded.downcast_ref::<SimError>(), None);
    /// ```
    pub fn downcast_ref<T: Error + 'static>(&self) -> Option<&T> {
        match self {
            Self::Other(OtherError(error)) => error.downcast_ref(),
            _ => None,
        }
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
