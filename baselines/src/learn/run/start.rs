//! Starting a run from a policy.

use std::fmt::Debug;

use super::env::LearnEnv;
use super::trainer::Trainer;
use crate::learn::error::TrainError;
use crate::trained::{LayerWeights, TrainedPolicy};
use crate::workers::agree;

impl<E: LearnEnv> Trainer<E> {
    /// Starts from a policy, before the first step, in all processes alike: the actor gets its
    /// weights, and the run its normalizers, which then stay as they are, with the policy's own
    /// `min_std` and `clip`. The environment of the policy may be another one with the same lengths.
    ///
    /// All else begins as in every run: the critic knows nothing yet, so the policy becomes much
    /// worse before it becomes better, unless the actor's learning rate is small, such as 0.0001.
    /// The first [`random_episodes`](crate::learn::ExplorationSettings::random_episodes) are random.
    ///
    /// # Errors
    /// [`TrainError::Start`] if lengths, inputs or layers differ from the run's, or the run has taken
    /// steps, and [`TrainError::Disagreement`] if processes start from different policies. Then
    /// nothing has changed.
    pub fn start_from(&mut self, policy: &TrainedPolicy) -> Result<(), TrainError> {
        let (header, dims) = (policy.header(), self.replay.buffer.config().dims());
        let start = ("policy to start from", format!("{header:?}"));
        agree(&mut *self.workers, &[start])?;
        if self.counters().steps > 0 {
            return Err(unfit("the run has taken steps"));
        }
        let lens = [header.observation_len, header.goal_len, header.action_len];
        let own_lens = [dims.observation, dims.goal, dims.action];
        same("the lengths of observation, goal and action", &lens, &own_lens)?;
        same("the inputs", &header.inputs, &self.replay.inputs.parts())?;
        let sizes = |layers: &[LayerWeights]| -> Vec<usize> {
            layers.iter().map(|layer| layer.biases.len()).collect()
        };
        let own_layers = self.updates.algorithm.greedy_layers();
        same("the sizes of the layers", &sizes(policy.layers()), &sizes(&own_layers))?;
        let mut layers = policy.layers().to_vec();
        self.replay.inputs.leave_out_weights(&mut layers[0]);
        if policy.layers() != layers {
            return Err(unfit("the policy uses elements that the run leaves out"));
        }
        let (Some(observation), Some(goal)) =
            (&header.observation_normalizer, &header.goal_normalizer)
        else {
            return Err(unfit("the policy does not normalize all of its inputs"));
        };
        let mut inputs = self.replay.inputs.clone();
        inputs.fix(observation, goal);
        if !self.updates.algorithm.set_greedy_layers(&layers) {
            return Err(unfit("the run's algorithm cannot begin with the layers of another actor"));
        }
        self.replay.inputs = inputs;
        Ok(())
    }
}

/// Checks that a policy and the run have the same.
fn same<T: Debug + PartialEq>(what: &str, policy: &T, run: &T) -> Result<(), TrainError> {
    if policy == run {
        return Ok(());
    }
    Err(unfit(format!("{what} are {policy:?} in the policy and {run:?} in the run")))
}

fn unfit(reason: impl Into<String>) -> TrainError {
    TrainError::Start { reason: reason.into() }
}
