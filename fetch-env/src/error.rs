use fetch_sim::SimError;

use crate::{ConfigError, UnknownEnvId, vec_env::VecEnvError};

/// Why an environment could not be made, reset, stepped or restored.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EnvError {
    /// A step before the first reset, or after a failure.
    #[error("the environment has not been reset: call reset() before step()")]
    ResetNeeded,
    /// A step after the episode's end.
    #[error("the episode is over (terminated or truncated): call reset() before the next step()")]
    EpisodeOver,
    /// The action has the wrong length.
    #[error("the action has {actual} elements, but the action space has {expected}")]
    ActionLength {
        /// Elements of the action space.
        expected: usize,
        /// Elements of the action.
        actual: usize,
    },
    /// An element of the action is NaN or infinite.
    #[error(
        "action[{index}] is {value}: pass finite numbers; finite ones are clipped to the action space"
    )]
    ActionNotFinite {
        /// Index of the element.
        index: usize,
        /// The element.
        value: f32,
    },
    /// A number in the reset options is NaN or infinite.
    #[error("the reset option {option} is not finite in element {index} ({value}): give meters")]
    OptionNotFinite {
        /// Name of the option.
        option: &'static str,
        /// Index of the element.
        index: usize,
        /// The element.
        value: f64,
    },
    /// A snapshot of another environment.
    #[error(
        "the snapshot does not fit this environment ({reason}): restore it into one made the same way"
    )]
    ForeignSnapshot {
        /// What differs.
        reason: String,
    },
    /// The simulator is not the one that the configuration asks for.
    #[error(
        "the simulator does not fit the configuration ({reason}): make it from the configuration's sim()"
    )]
    SimulatorMismatch {
        /// What differs.
        reason: String,
    },
    /// The operating system gave no random seed.
    #[error("the operating system gave no random seed ({reason}): pass one to reset()")]
    Entropy {
        /// What the operating system said.
        reason: String,
    },
    /// The simulator failed.
    #[error(transparent)]
    Sim(SimError),
    /// The environment panicked while a [`VecEnv`](crate::VecEnv) stepped it.
    #[error("the environment panicked ({message}) and is out of use: make the environments anew")]
    Panicked {
        /// What the panic said.
        message: String,
    },
    /// The environment could not be drawn.
    #[cfg(feature = "render")]
    #[error(transparent)]
    Render(#[from] fetch_sim::RenderError),
    /// The configuration cannot be.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// There is no environment of this name.
    #[error(transparent)]
    UnknownId(#[from] UnknownEnvId),
    /// The environments could not be made into one.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
}

impl EnvError {
    /// Whether a step that was refused so has changed nothing; see [`Env::step`](crate::Env::step).
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
            // One variant to match on, whichever layer noticed it.
            SimError::ForeignSnapshot { reason } => Self::ForeignSnapshot { reason },
            error => Self::Sim(error),
        }
    }
}
