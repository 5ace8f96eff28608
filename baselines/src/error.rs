use fetch_env::EnvError;
use her_relabel::AddError;

/// Why an evaluation has no result.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluationError {
    /// There is nothing to take a mean of.
    #[error("no episode to evaluate: ask for at least one")]
    NoEpisodes,
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// Which episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// What the environment said.
        source: EnvError,
    },
}

/// Why episodes could not be collected.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CollectError {
    /// The environment failed.
    #[error("episode {episode} (seed {seed}) failed")]
    Environment {
        /// Which episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// What the environment said.
        source: EnvError,
    },
    /// The buffer did not take what the environment gave.
    #[error("episode {episode} (seed {seed}) does not go into the buffer")]
    Buffer {
        /// Which episode, counted from 0.
        episode: usize,
        /// The seed of its reset.
        seed: u64,
        /// What the buffer said.
        source: AddError,
    },
}
