//! The error of drawing a batch.

use goal_reward::GoalError;
use thiserror::Error;

/// Error returned when no batch can be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The batch would have no rows.
    #[error("`batch_size` is 0: set it to at least 1")]
    EmptyBatch,
    /// No episode has ended yet.
    #[error(
        "the buffer has no finished episode, and only finished episodes can be relabeled: step the environments until one ends, or call end_episode"
    )]
    NoFinishedEpisode,
    /// The sampler draws by priority, but the buffer has no priorities.
    #[error("the buffer has no priorities: configure them with `BufferConfig::with_priorities`")]
    NoPriorities,
    /// Every priority is 0.
    #[error("all priorities are 0, so that none can be drawn: set a positive one")]
    ZeroPriorities,
    /// The rows of the batch, or the steps of their windows, cannot be addressed.
    #[error("a batch of this size exceeds the address space: reduce `batch_size` or `n_step`")]
    TooLarge,
    /// The reward function rejected the goals of the batch.
    #[error("the reward function failed on the relabeled goals: {0}")]
    Reward(#[from] GoalError),
    /// The reward function returned NaN, infinity, or a number beyond the buffer's type.
    #[error(
        "the reward of row {row} is {reward}, which the buffer's type cannot hold as a finite number: check the reward function"
    )]
    RewardNotFinite {
        /// The row of the batch.
        row: usize,
        /// The reward.
        reward: f64,
    },
}
