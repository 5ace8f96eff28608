//! Batches as networks see them.

use goal_reward::GoalReward;
use her_relabel::{Batch, ColumnsMut, HerBuffer, Sampler};

use super::algorithm::Transitions;
use super::error::TrainError;
use super::inputs::Inputs;

/// A batch of transitions as networks see it, which keeps its memory for the next draw.
#[derive(Debug, Default)]
pub struct TrainBatch {
    batch: Batch<f32>,
    inputs: Vec<f32>,
    next_inputs: Vec<f32>,
}

impl TrainBatch {
    /// Draws transitions from a buffer, whose inputs are written as they are drawn. The sampler
    /// needs a discount ([`Sampler::with_discount`]), which an algorithm takes from the batch.
    ///
    /// # Errors
    /// [`TrainError::Sample`] if the buffer is empty, if the sampler cannot draw from it, or if `inputs`
    /// are of other lengths.
    pub fn draw<F: GoalReward + ?Sized>(
        &mut self,
        inputs: &Inputs,
        sampler: &Sampler,
        buffer: &HerBuffer<f32>,
        reward: &F,
        seed: u64,
    ) -> Result<(), TrainError> {
        let len = sampler.batch_size() * inputs.dim();
        self.inputs.resize(len, 0.0);
        self.next_inputs.resize(len, 0.0);
        let columns = ColumnsMut {
            input: &mut self.inputs,
            next_input: &mut self.next_inputs,
            ..ColumnsMut::default()
        };
        let (joined, normalizers) =
            (sampler.with_joined_goal(inputs.joined_goal()), inputs.normalizers());
        joined.sample_into(buffer, reward, seed, &mut self.batch, normalizers, columns)?;
        Ok(())
    }

    /// Returns the transitions of the last draw, for [`Algorithm::update`](super::Algorithm::update).
    #[must_use]
    pub fn transitions(&self) -> Transitions<'_> {
        Transitions {
            len: self.batch.len(),
            inputs: &self.inputs,
            actions: self.batch.action(),
            rewards: self.batch.reward(),
            discounts: self.batch.discount(),
            next_inputs: &self.next_inputs,
        }
    }
}
