//! What sees more of a batch than the numbers of its states.

use std::io::{self, Write};

use fetch_env::vec_env::{BatchObservation, VecStep};
use goal_reward::GoalReward;
use serde::{Deserialize, Serialize};

use super::inputs::Inputs;
use crate::learn::algorithm::interface::Algorithm;
use crate::learn::algorithm::state_file::StateFault;
use crate::learn::error::RunError;
#[cfg(feature = "render")]
use crate::trained::{PixelPolicy, PolicyHeader, TrainedPolicyError};

#[cfg(feature = "render")]
pub(crate) type SightOf = crate::trained::Sight;
/// Nothing sees pictures, but a checkpoint may be of something that does.
#[cfg(not(feature = "render"))]
pub(crate) type SightOf = serde_json::Value;

/// What a checkpoint has of an actor that sees more than the state, besides its networks and what it
/// remembers.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct EyesState {
    /// What it sees.
    pub(crate) sight: SightOf,
    pub(crate) inputs: Inputs,
    pub(crate) num_updates: u64,
    /// The number of all states so far.
    pub(crate) frames: u64,
}

/// An actor that sees more than the state, and learns from the critic of an algorithm that sees the
/// state.
pub(crate) trait Eyes<O: BatchObservation, I>: Send {
    /// Remembers the batch that a decision sees: after a [`restore`](Self::restore) that of the
    /// checkpoint.
    fn see(&mut self, batch: &VecStep<O, I>);

    /// Replaces the exploring actions of the algorithm in this actor's environments, for the batch
    /// that it has just seen. `noise` is as for [`Algorithm::explore`].
    fn explore(&mut self, noise: &[f32], actions: &mut [f32]);

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

    /// Returns its state and its networks as a file, or why they could not be read again.
    fn state(&mut self) -> Result<(EyesState, Vec<u8>), String>;

    /// Writes what it remembers, and the batch that the next decision will see, if there is one.
    fn write_memory(&self, batch: Option<&VecStep<O, I>>, to: &mut dyn Write) -> io::Result<()>;

    /// Goes on from its state, its networks and what it remembers.
    fn restore(
        &mut self,
        state: EyesState,
        networks: &[u8],
        memory: &[u8],
    ) -> Result<(), StateFault>;

    /// Returns the greedy policy of a run that a header describes.
    #[cfg(feature = "render")]
    fn policy(&self, header: PolicyHeader) -> Result<PixelPolicy, TrainedPolicyError>;
}
