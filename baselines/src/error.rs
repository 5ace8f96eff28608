//! The errors of evaluating and of collecting episodes.

use fetch_env::EnvError;
use her_relabel::AddError;

/// Error returned by an evaluation.
#[derive(Debug, thiserror::Error)]
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
}

/// Error returned where episodes cannot be collected.
#[derive(Debug, thiserror::Error)]
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
