//! The error of making a page.

use fetch_env::{EnvError, SimError};

use crate::policy::PolicyError;

/// Error returned when a page, or a part of it, cannot be made.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum PageError {
    /// The policy does not fit this environment.
    #[error(transparent)]
    Policy(#[from] PolicyError),
    /// The environment failed during the episode.
    #[error("the episode with seed {seed} failed")]
    Environment {
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// The model has a shape that the playback cannot draw.
    #[error("the playback cannot draw {shape}: leave it out of the model")]
    Shape {
        /// The shape.
        shape: String,
    },
    /// The simulator's model or a pose cannot be read.
    #[error(transparent)]
    Simulator(#[from] SimError),
    /// The environment's view of a state cannot be played back.
    #[error("the scene cannot be shown: {reason}")]
    Scene {
        /// What is wrong.
        reason: String,
    },
    /// The episode cannot be written as JSON.
    #[error("the episode cannot be written as JSON")]
    Json(#[from] serde_json::Error),
    /// The plot cannot be drawn: an axis cannot be shown, or the plotting library failed.
    #[error("the plot {plot:?} cannot be drawn: {reason}")]
    Plot {
        /// The title of the plot.
        plot: String,
        /// What is wrong.
        reason: String,
    },
}

debug_as_display!(PageError);
