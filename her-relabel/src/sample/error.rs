//! The error of drawing a batch.

use goal_reward::GoalError;
use thiserror::Error;

/// Error returned when no batch can be drawn.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum SampleError {
    /// The batch would have no rows.
    #[error("`batch_size` is 0: set it to at least 1")]
    EmptyBatch,
    /// No episode has ended yet.
    #[error(
        "the buffer has no finished episode, and only finished episodes can be relabeled: step the \
         environments until one ends, or call end_episode"
    )]
    NoFinishedEpisode,
    /// The sampler draws by priority, but the buffer has no priorities.
    #[error("the buffer has no priorities: configure them with `BufferConfig::with_priorities`")]
    NoPriorities,
    /// Every priority is 0.
    #[error("all priorities are 0, so nothing can be drawn: set a positive one")]
    ZeroPriorities,
    /// There is not enough memory for the rows of the batch or the steps of their windows.
    #[error("there is no memory for a batch of this size: reduce `batch_size` or `n_step`")]
    TooLarge,
    /// A caller-provided buffer for a column has the wrong length.
    #[error(
        "the memory for `{column}` has {actual} elements, but the column has {expected}: pass \
         memory of that length, or none"
    )]
    WrongLength {
        /// The column.
        column: &'static str,
        /// The number of elements of the column, 0 if the sampler's batches do not have it.
        expected: usize,
        /// The length of the memory.
        actual: usize,
    },
    /// A normalizer of the draw is for vectors of another length.
    #[error(
        "a normalizer has {actual} elements instead of {expected}: pass normalizers for this \
         buffer's observations and goals"
    )]
    NormalizerDim {
        /// The length of the vectors in the buffer.
        expected: usize,
        /// The dimensions of the normalizer.
        actual: usize,
    },
    /// The sampler mirrors rows, but the draw has no symmetry.
    #[error("rows cannot be mirrored without a symmetry: pass the task's in `Transforms`")]
    NoSymmetry,
    /// The symmetry of the draw is for vectors of another length.
    #[error("a mirror has {actual} elements instead of {expected}: pass the symmetry of this task")]
    SymmetryDim {
        /// The length of the vectors in the buffer.
        expected: usize,
        /// The length of the mirror's vectors.
        actual: usize,
    },
    /// The radius of the goal noise is negative or not finite.
    #[error("the radius of the goal noise is {radius}: use a finite number, at least 0")]
    BadRadius {
        /// The radius.
        radius: f64,
    },
    /// The reward function rejected the goals of the batch.
    #[error("the reward function failed on the relabeled goals: {0}")]
    Reward(#[from] GoalError),
    /// The reward function returned a number that is not finite in the batch's type, or the sum of
    /// a window of its rewards is not.
    #[error(
        "the reward of row {row} is {reward}, which the batch's type cannot hold as a finite \
         number: check the reward function"
    )]
    RewardNotFinite {
        /// The row of the batch.
        row: usize,
        /// The reward.
        reward: f64,
    },
}
debug_as_display!(SampleError);
