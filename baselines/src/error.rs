//! The errors of evaluating and of collecting episodes.

use fetch_env::{EnvError, vec_env::VecEnvError};
use her_relabel::AddError;

use crate::statistics::StatisticsError;
use crate::workers::UnreadableMessage;

/// Error returned by an evaluation.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// There are no episodes to take a mean of.
    #[error("there is no episode to evaluate: run at least one")]
    NoEpisodes,
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// A return or a distance is not a finite number.
    #[error("no mean can be taken over the episodes")]
    Statistics(#[from] StatisticsError),
    /// Another process has sent episodes that cannot be read.
    #[error(transparent)]
    Unreadable(#[from] UnreadableMessage),
}

debug_as_display!(EvaluationError);

/// Error returned by a [`Collector`](crate::Collector).
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum CollectorError {
    /// The environments could not be stepped together.
    #[error(transparent)]
    Vec(#[from] VecEnvError),
    /// An environment could not be reset.
    #[error("environment {env_index} could not be reset")]
    Environment {
        /// Id of the environment.
        env_index: usize,
        /// The environment's error.
        source: EnvError,
    },
    /// The buffer is not one for these environments.
    #[error(
        "the buffer does not fit the environments: make it from buffer_config() of one of them"
    )]
    Buffer(#[from] AddError),
    /// An environment returned numbers that the buffer cannot store.
    #[error("environment {env_index} returned a number that the buffer cannot store")]
    NotFinite {
        /// Id of the environment.
        env_index: usize,
        /// The number, and where it is.
        source: AddError,
    },
}

debug_as_display!(CollectorError);

/// Error returned where episodes cannot be collected.
#[derive(thiserror::Error)]
#[non_exhaustive]
pub enum CollectError {
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The environment's error.
        source: EnvError,
    },
    /// The buffer rejected an episode.
    #[error("the buffer rejected episode {episode} (seed {seed})")]
    Buffer {
        /// The episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// The buffer's error.
        source: AddError,
    },
}

debug_as_display!(CollectError);
