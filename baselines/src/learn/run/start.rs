//! Starting a run from a policy.

use std::fmt::Debug;

use super::env::LearnEnv;
use super::trainer::Trainer;
use crate::learn::error::TrainError;
use crate::trained::{LayerWeights, TrainedPolicy};
use crate::workers::agree;

impl<E: LearnEnv> Trainer<E> {
    /// Starts from a policy, before the first step, in all processes alike: the actor gets its
    /// weights, and the normalizers what its own have seen. The environment of the policy may be
    /// another one with the same lengths.
    ///
    /// All else begins as in every run: the critic knows nothing yet, so the policy becomes much
    /// worse before it becomes better, unless the actor's learning rate is small, such as 0.0001.
    /// The first [`random_episodes`](crate::learn::ExplorationSettings::random_episodes) are random.
    ///
    /// # Errors
    /// [`TrainError::Start`] if lengths, inputs or layers differ from the run's, and
    /// [`TrainError::Disagreement`] if processes start from different policies.
    pub fn start_from(&mut self, policy: &TrainedPolicy) -> Result<(), TrainError> {
        let (header, dims) = (policy.header(), self.replay.buffer.config().dims());
        let start = ("policy to start from", format!("{header:?}"));
        agree(&mut *self.workers, &[start])?;
        let lens = [header.observation_len, header.goal_len, header.action_len];
        let own_lens = [dims.observation, dims.goal, dims.action];
        same("the lengths of observation, goal and action", &lens, &own_lens)?;
        same("the inputs", &header.inputs, &self.replay.inputs.parts())?;
        let sizes = |layers: &[LayerWeights]| -> Vec<usize> {
            layers.iter().map(|layer| layer.biases.len()).collect()
        };
        let own_layers = self.updates.algorithm.greedy_layers();
        same("layers of the sizes", &sizes(policy.layers()), &sizes(&own_layers))?;
        let mut layers = policy.layers().to_vec();
        self.replay.inputs.leave_out_weights(&mut layers[0]);
        let unseen = policy.layers() != layers;
        same("weights for inputs that are left out:", &unseen, &false)?;
        let inputs = &mut self.replay.inputs;
        let pairs = [
            (&mut inputs.observation, &header.observation_normalizer),
            (&mut inputs.goal, &header.goal_normalizer),
        ];
        for (own, theirs) in pairs {
            match theirs {
                Some(theirs) => own.merge(theirs)?,
                None => same("normalizers:", &false, &true)?,
            }
        }
        let is_set = self.updates.algorithm.set_greedy_layers(&layers);
        same("an actor that can be replaced:", &true, &is_set)
    }
}

/// Checks that a policy and the run have the same.
fn same<T: Debug + PartialEq>(what: &'static str, policy: &T, run: &T) -> Result<(), TrainError> {
    if policy == run {
        return Ok(());
    }
    Err(TrainError::Start { what, policy: format!("{policy:?}"), run: format!("{run:?}") })
}
