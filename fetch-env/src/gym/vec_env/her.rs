//! Batches as rows of a hindsight replay buffer.

use her_relabel::StepRows;

use super::batch::Batch;
use crate::gym::env::observation::GoalObservation;

/// A batch as the rows that [`HerBuffer::record`](her_relabel::HerBuffer::record) takes.
///
/// Recording every batch, that of the first reset included, stores every step, in each
/// [`AutoresetMode`](super::AutoresetMode), from [`step`](super::VecEnv::step) as well as from
/// [`recv`](super::VecEnv::recv).
///
/// ```
/// use fetch_env::{make_kinematic_vec, vec_env::VecConfig};
/// use her_relabel::{BufferConfig, Dims, HerBuffer};
///
/// let mut envs = make_kinematic_vec("FetchPush-v4", 4, VecConfig::default())?;
/// let dims = Dims { observation: 25, goal: 3, action: 4 };
/// let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(10_000, dims).with_num_envs(4))?;
/// buffer.record(&envs.reset(Some(42))?.into())?;
/// for _ in 0..50 {
///     buffer.record(&envs.step(&[0.1; 4 * 4])?.into())?;
/// }
/// assert_eq!(buffer.len(), 4 * 50);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
impl<'a, O, I, A> From<&'a Batch<O, I, A>> for StepRows<'a, O::Element, f64, A>
where
    O: GoalObservation,
{
    fn from(batch: &'a Batch<O, I, A>) -> Self {
        Self {
            env_ids: batch.env_ids(),
            stepped: batch.stepped(),
            started: batch.started(),
            actions: batch.action(),
            rewards: batch.reward(),
            next_observations: batch.next_observation(),
            next_achieved_goals: batch.next_achieved_goal(),
            terminated: batch.terminated(),
            truncated: batch.truncated(),
            observations: batch.observation(),
            achieved_goals: batch.achieved_goal(),
            desired_goals: batch.desired_goal(),
            fields: &[],
        }
    }
}
