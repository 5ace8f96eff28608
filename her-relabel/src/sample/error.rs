//! Why a batch cannot be drawn.

use goal_reward::GoalError;
use thiserror::Error;

/// Why no batch can be drawn.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// A batch of no rows was asked for.
    #[error("`batch_size` is 0; ask for at least one row")]
    EmptyBatch,
    /// Nothing is stored yet.
    #[error(
        "the buffer holds no finished episode, and only finished episodes can be relabeled; step \
         the environments until one ends, or call end_episode"
    )]
    NoFinishedEpisode,
    /// The sampler goes by priorities, which the buffer does not have.
    #[error("the buffer has no priorities; set `priorities` of its configuration")]
    NoPriorities,
    /// Every priority is 0.
    #[error("all priorities are 0, so nothing can be drawn by them; set a positive one")]
    ZeroPriorities,
    /// The rows of the batch, or the steps of their windows, cannot be addressed.
    #[error("a batch of this size exceeds the address space; check `batch_size` and `n_step`")]
    TooLarge,
    /// The reward function refused the goals of the batch.
    #[error("the reward function failed on the relabeled goals: {0}")]
    Reward(#[from] GoalError),
    /// The reward function gave NaN or infinity, or a number beyond the buffer's type.
    #[error(
        "the reward of row {row} is {reward}, which the buffer's type cannot hold as a finite \
         number; check the reward function"
    )]
    RewardNotFinite {
        /// The row of the batch.
        row: usize,
        /// The reward.
        reward: f64,
    },
}
