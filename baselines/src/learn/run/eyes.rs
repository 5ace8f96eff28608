//! What sees more of a batch than the numbers of its states.

use fetch_env::vec_env::{BatchObservation, VecStep};
use goal_reward::GoalReward;

use super::inputs::Inputs;
use crate::learn::algorithm::interface::Algorithm;
use crate::learn::error::RunError;
#[cfg(feature = "render")]
use crate::trained::{PixelPolicy, PolicyHeader, TrainedPolicyError};

/// An actor that sees more than the state, and learns from the critic of an algorithm that sees the
/// state.
pub(crate) trait Eyes<O: BatchObservation, I>: Send {
    /// Remembers the batch that a decision sees.
    fn see(&mut self, batch: &VecStep<O, I>);

    /// Replaces the exploring actions of the algorithm in this actor's environments. `noise` is as
    /// for [`Algorithm::explore`].
    fn explore(&mut self, batch: &VecStep<O, I>, noise: &[f32], actions: &mut [f32]);

    /// Writes greedy actions, and numbers that are not finite for such states.
    fn act(&mut self, batch: &VecStep<O, I>, actions: &mut [f32]);

    /// Learns after the algorithm's update `number`, counted from 0. `inputs` are the algorithm's.
    fn update(
        &mut self,
        number: u64,
        algorithm: &mut dyn Algorithm,
        inputs: &Inputs,
        reward: &dyn GoalReward,
    ) -> Result<(), RunError>;

    /// Returns the greedy policy of a run that a header describes.
    #[cfg(feature = "render")]
    fn policy(&self, header: PolicyHeader) -> Result<PixelPolicy, TrainedPolicyError>;
}
