//! The results of many environments as rows of a hindsight replay buffer.

use her_relabel::StepRows;

use super::step::VecStep;
use crate::gym::env::observation::GoalObservation;

/// The results as the rows that [`HerBuffer::record`](her_relabel::HerBuffer::record) takes.
///
/// Recording every call, that of the first reset included, stores every step, in each
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
impl<'a, O, I, A> From<&'a VecStep<O, I, A>> for StepRows<'a, O::Element, f64, A>
where
    O: GoalObservation,
{
    fn from(step: &'a VecStep<O, I, A>) -> Self {
        Self {
            env_index: step.env_index(),
            stepped: step.stepped(),
            started: step.started(),
            action: step.action(),
            reward: step.reward(),
            next_observation: step.next_observation(),
            next_achieved_goal: step.next_achieved_goal(),
            terminated: step.terminated(),
            truncated: step.truncated(),
            observation: step.observation(),
            achieved_goal: step.achieved_goal(),
            desired_goal: step.desired_goal(),
            fields: &[],
        }
    }
}
