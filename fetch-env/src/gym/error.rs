//! Errors of environments.

use std::{error::Error, ops::RangeInclusive, sync::Arc};

use fetch_sim::SimError;

/// Error returned when an environment cannot be reset, stepped, restored or wrapped.
#[derive(Clone, thiserror::Error)]
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
    #[error("the action has {actual} elements: pass {expected}")]
    ActionLength {
        /// Number of elements of the action space.
        expected: usize,
        /// Number of elements of the action.
        actual: usize,
    },
    /// An element of the action is NaN or infinite.
    #[error(
        "action[{index}] is {value:?}: pass finite numbers; finite ones are clipped to the action \
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
        "the {key} has {actual} elements, but its space has {expected}: make observation_space() \
         describe what the environment observes"
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
        "the option {option} is {value:?} at index {index}: pass numbers from -{most} to {most}"
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
    /// A reset option of the wrong length.
    #[error("the option {option} has {actual} elements: pass {expected}")]
    OptionLength {
        /// Name of the option.
        option: &'static str,
        /// Number of elements that the environment takes.
        expected: usize,
        /// Number of elements of the option.
        actual: usize,
    },
    /// A reset option that does not fit the environment, or another option.
    #[error("the option {option} {reason}")]
    OptionUnfit {
        /// Name of the option.
        option: &'static str,
        /// Why it does not fit, and what to do.
        reason: &'static str,
    },
    /// A setting of a wrapper is out of range.
    #[error("{name} is {value:?}: pass a number from {least} to {most}")]
    SettingOutside {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// The smallest valid value.
        least: f64,
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
    /// Anything else, such as a failure of the simulator; see
    /// [`downcast_ref`](Self::downcast_ref).
    #[error(transparent)]
    Other(Arc<dyn Error + Send + Sync>),
}

debug_as_display!(EnvError);

/// Two errors are equal if they have the same message.
impl PartialEq for EnvError {
    fn eq(&self, other: &Self) -> bool {
        self.to_string() == other.to_string()
    }
}

impl EnvError {
    /// Wraps an environment's own error, given as an error or a message. The environment must be
    /// reset afterwards.
    ///
    /// ```
    /// use fetch_env::EnvError;
    ///
    /// let error = EnvError::other("the robot lost its connection: check the cable");
    /// assert_eq!(error.to_string(), "the robot lost its connection: check the cable");
    /// ```
    pub fn other(error: impl Into<Box<dyn Error + Send + Sync>>) -> Self {
        Self::Other(Arc::from(error.into()))
    }

    /// Returns the error that [`other`](Self::other) wrapped, if it is a `T`.
    ///
    /// It can be a [`SpaceError`](crate::spaces::SpaceError), if an environment cannot be wrapped,
    /// a [`VecEnvError`](crate::vec_env::VecEnvError), in Fetch environments a
    /// [`SimError`](crate::SimError) or [`MakeError`](crate::MakeError), and with pictures a
    /// `RenderError` or `ClipError`.
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
            Self::Other(error) => error.downcast_ref(),
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

    /// Whether a reset was refused with this error because of its options, and has changed nothing.
    pub(crate) fn refuses_options(&self) -> bool {
        use EnvError::{OptionLength, OptionOutside, OptionUnfit};
        matches!(self, OptionLength { .. } | OptionOutside { .. } | OptionUnfit { .. })
            || matches!(self.downcast_ref(), Some(SimError::NoObject { .. }))
    }
}

/// Checks a setting of a wrapper.
pub(super) fn check_setting(
    name: &'static str,
    value: f64,
    range: RangeInclusive<f64>,
) -> Result<(), EnvError> {
    if range.contains(&value) {
        return Ok(());
    }
    let (least, most) = range.into_inner();
    Err(EnvError::SettingOutside { name, value, least, most })
}
