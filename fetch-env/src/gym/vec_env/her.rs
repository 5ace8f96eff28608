//! The results of many environments as rows of a hindsight replay buffer, and of a network's input.

use her_relabel::{AsStepRows, RowNumbers, Scalar, StateRows, StepRows};

use super::step::VecStep;
use crate::gym::env::observation::GoalObservation;

/// The results as the rows that [`HerBuffer::record`](her_relabel::HerBuffer::record) takes.
///
/// Recording every call, including the first reset, stores every step, in every
/// [`AutoresetMode`](super::AutoresetMode), from both [`step`](super::VecEnv::step) and
/// [`recv`](super::VecEnv::recv). The rows have numbers: a buffer refuses those that were recorded
/// before, and those that do not follow the ones recorded before, from this vector or another.
/// [`resume`](her_relabel::HerBuffer::resume) with [`last_step`](super::VecEnv::last_step) goes on
/// after that, and in a vector that was [restored](super::VecEnv::restore).
///
/// ```
/// use fetch_env::{GoalEnvExt, make_kinematic_vec, vec_env::VecConfig};
/// use her_relabel::{BufferConfig, HerBuffer};
///
/// let mut envs = make_kinematic_vec("FetchPush-v4", 4, VecConfig::default())?;
/// let dims = envs.env(0).ok_or("it is in flight")?.dims()?;
/// let mut buffer = HerBuffer::<f32>::new(BufferConfig::new(10_000, dims).with_num_envs(4))?;
/// buffer.record(envs.reset(Some(42))?)?.check()?;
/// for _ in 0..50 {
///     buffer.record(envs.step(&[0.1; 4 * 4])?)?.check()?;
/// }
/// assert_eq!(buffer.len(), 4 * 50);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
impl<O, I, A> AsStepRows for VecStep<O, I, A>
where
    O: GoalObservation<Element: Scalar>,
    A: Scalar,
{
    type Observation = O::Element;
    type Goal = f64;
    type Action = A;

    fn as_step_rows(&self) -> StepRows<'_, O::Element, f64, A> {
        StepRows {
            env_index: self.env_index(),
            stepped: self.stepped(),
            started: self.started(),
            action: self.action(),
            reward: self.reward(),
            next_observation: self.next_observation(),
            next_achieved_goal: self.next_achieved_goal(),
            next_desired_goal: self.next_desired_goal(),
            terminated: self.terminated(),
            truncated: self.truncated(),
            observation: self.observation(),
            achieved_goal: self.achieved_goal(),
            desired_goal: self.desired_goal(),
            fields: &[],
            numbers: Some(RowNumbers { source: self.source(), number: self.number() }),
        }
    }
}

/// The states in which the next actions are taken, as the rows that
/// [`Normalizers::write_input`](her_relabel::Normalizers::write_input) takes.
///
/// ```
/// use fetch_env::{make_kinematic_vec, vec_env::VecConfig};
/// use her_relabel::{Dims, JoinedGoal, Normalizers};
///
/// let mut envs = make_kinematic_vec("FetchPush-v4", 4, VecConfig::default())?;
/// let dims = Dims { observation: 25, goal: 3, action: 4 };
/// let normalizers = Normalizers::default(); // or those of a learner
/// let mut input = vec![0.0_f32; 4 * 28];
/// let states = envs.reset(Some(42))?.into();
/// normalizers.write_input(JoinedGoal::Desired, dims, &states, &mut input)?;
/// assert_eq!(f64::from(input[0]), f64::from(envs.last_step().observation()[0] as f32));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
impl<'a, O, I, A> From<&'a VecStep<O, I, A>> for StateRows<'a, O::Element, f64>
where
    O: GoalObservation,
{
    fn from(step: &'a VecStep<O, I, A>) -> Self {
        Self {
            observation: step.observation(),
            achieved_goal: step.achieved_goal(),
            desired_goal: step.desired_goal(),
        }
    }
}
