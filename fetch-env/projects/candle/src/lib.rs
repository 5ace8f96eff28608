//! Candle tensors from batches of a hindsight replay buffer, in two ways: the columns of a batch
//! become tensors as they are, or a batch is drawn into one piece of memory that goes to the device
//! in one transfer. Either way a network gets `f32` numbers from a buffer of either precision.

use candle_core::{Device, Error, Result, Tensor};
use her_relabel::goal_reward::GoalReward;
use her_relabel::{
    Batch, ColumnsMut, Dims, HerBuffer, JoinedGoal, Normalizers, Sampler, Scalar, UnitInterval,
};

/// The parts of a batch that a learner needs, with a row for each transition.
#[derive(Clone, Debug)]
pub struct Tensors {
    /// Observation and goal, side by side.
    pub input: Tensor,
    pub action: Tensor,
    pub reward: Tensor,
    /// Factor of the next value, 0 where the task ended: the target is `reward + discount * value`.
    pub discount: Tensor,
    pub next_input: Tensor,
}

/// Sets up a sampler for [`Tensors`].
pub fn for_tensors(sampler: Sampler, gamma: UnitInterval) -> Sampler {
    sampler.with_joined_goal(JoinedGoal::Desired).with_discount(gamma)
}

impl Tensors {
    /// Turns the columns of a batch into tensors; on the CPU without a copy.
    pub fn take(batch: &mut Batch<f32>, device: &Device) -> Result<Self> {
        let rows = batch.len();
        let columns = batch.take_columns();
        let matrix = |column: Vec<f32>| Tensor::from_vec(column, (rows, ()), device);
        Ok(Self {
            input: matrix(columns.input)?,
            action: matrix(columns.action)?,
            reward: matrix(columns.reward)?,
            discount: matrix(columns.discount)?,
            next_input: matrix(columns.next_input)?,
        })
    }
}

/// Memory into which whole batches are drawn, one after the other, without an allocation.
#[derive(Debug)]
pub struct Staging {
    sampler: Sampler,
    /// The lengths of a row of input, action, reward, discount and next input.
    widths: [usize; 5],
    /// All five columns. For a graphics card, this would be pinned memory.
    memory: Vec<f32>,
    /// The columns that no tensor needs.
    others: Batch<f32>,
}

impl Staging {
    /// Makes memory for batches of a sampler that [`for_tensors`] set up.
    pub fn new(sampler: Sampler, dims: Dims) -> Self {
        let input = dims.observation + dims.goal;
        let widths = [input, dims.action, 1, 1, input];
        let memory = vec![0.0; sampler.batch_size() * widths.iter().sum::<usize>()];
        Self { sampler, widths, memory, others: Batch::new() }
    }

    /// Draws a batch and transfers it to the device at once. The tensors are views of one memory.
    pub fn draw<S: Scalar>(
        &mut self,
        buffer: &HerBuffer<S>,
        reward: &impl GoalReward,
        seed: u64,
        device: &Device,
    ) -> Result<Tensors> {
        let rows = self.sampler.batch_size();
        let mut rest = &mut self.memory[..];
        let [input, action, rewards, discount, next_input] = self.widths.map(|width| {
            let (column, others) = std::mem::take(&mut rest).split_at_mut(rows * width);
            rest = others;
            column
        });
        let columns = ColumnsMut {
            input,
            action,
            reward: rewards,
            discount,
            next_input,
            ..ColumnsMut::default()
        };
        self.sampler
            .sample_into(buffer, reward, seed, &mut self.others, Normalizers::default(), columns)
            .map_err(Error::wrap)?;

        let all = Tensor::from_slice(&self.memory, self.memory.len(), device)?;
        let mut start = 0;
        let mut column = |width| {
            let view = all.narrow(0, start, rows * width)?.reshape((rows, width));
            start += rows * width;
            view
        };
        let [input, action, reward, discount, next_input] = self.widths;
        Ok(Tensors {
            input: column(input)?,
            action: column(action)?,
            reward: column(reward)?,
            discount: column(discount)?,
            next_input: column(next_input)?,
        })
    }
}
