//! Policies of one environment and of many, and the simplest one.

mod error;
mod random;

use fetch_env::vec_env::VecStep;
use fetch_env::{BatchObservation, FetchObservation, Info, Space};

pub use error::PolicyError;
pub use random::RandomPolicy;

/// An action of the Fetch tasks: x, y and z displacement of the gripper, and the fingers, each in
/// [-1, 1].
pub type Action = [f32; 4];

/// A policy: it chooses an action for each observation.
///
/// `O` is the observation and `A` an element of the action. Closures are policies:
///
/// ```
/// use baselines::evaluate;
/// use fetch_env::{GoalObservation, FetchObservation, make_kinematic};
///
/// let mut straight = |observation: &FetchObservation, action: &mut [f32]| {
///     let (achieved, desired) = (observation.achieved_goal(), observation.desired_goal());
///     for axis in 0..3 {
///         action[axis] = ((desired[axis] - achieved[axis]) / 0.05) as f32;
///     }
/// };
/// let mut env = make_kinematic("FetchReach-v4")?;
/// let result = evaluate(&mut env, &mut straight, 10, 0, |_| ())?;
/// assert_eq!(result.summary()?.success_rate.value, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Policy<O = FetchObservation, A = f32> {
    /// Checks that the policy fits environments with these spaces, before the first step in one.
    /// The default accepts all.
    ///
    /// # Errors
    /// [`PolicyError`] if the policy would act on numbers that mean something else; your own error
    /// is [`PolicyError::Other`].
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        let _ = (observation_space, action_space);
        Ok(())
    }

    /// Forgets the last episode.
    fn reset(&mut self) {}

    /// Writes the action for an observation to `action`, which has as many elements as the action
    /// space.
    ///
    /// A policy that cannot act on an observation, such as one with NaN, writes NaN, which
    /// environments refuse ([`EnvError::ActionNotFinite`](fetch_env::EnvError::ActionNotFinite)).
    fn act(&mut self, observation: &O, action: &mut [A]);
}

impl<O, A, F: FnMut(&O, &mut [A])> Policy<O, A> for F {
    fn act(&mut self, observation: &O, action: &mut [A]) {
        self(observation, action);
    }
}

/// A policy of many environments: it chooses the actions of all of them at once.
///
/// `O` is the observation of an environment, `I` its info and `A` an element of its actions, as in
/// a [`VecStep`]. [`RandomPolicy`], [`ZeroPolicy`] and [`TrainedPolicy`](crate::TrainedPolicy) are
/// policies of one environment and of many, as are closures:
///
/// ```
/// use baselines::evaluate_vec;
/// use fetch_env::{FetchObservation, VecEnv, make_kinematic};
/// use fetch_env::vec_env::{VecConfig, VecStep};
///
/// let mut straight = |batch: &VecStep<FetchObservation>, actions: &mut [f32]| {
///     let goals = batch.achieved_goal().chunks_exact(3).zip(batch.desired_goal().chunks_exact(3));
///     for ((achieved, desired), action) in goals.zip(actions.chunks_exact_mut(4)) {
///         for axis in 0..3 {
///             action[axis] = ((desired[axis] - achieved[axis]) / 0.05) as f32;
///         }
///     }
/// };
/// let envs = [make_kinematic("FetchReach-v4")?, make_kinematic("FetchReach-v4")?];
/// let mut envs = VecEnv::new(envs, VecConfig::default())?;
/// let result = evaluate_vec(&mut envs, &mut straight, 10, 0, |_| ())?;
/// assert_eq!(result.summary()?.success_rate.value, 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait VecPolicy<O: BatchObservation = FetchObservation, I = Info, A = f32> {
    /// Checks that the policy fits environments that each have these spaces, before their first
    /// step. The default accepts all.
    ///
    /// # Errors
    /// As [`Policy::check_spaces`].
    fn check_spaces(
        &self,
        observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        let _ = (observation_space, action_space);
        Ok(())
    }

    /// Forgets the last episodes, because all environments were reset. For environments that begin
    /// an episode by themselves, see [`VecStep::started`].
    fn reset_all(&mut self) {}

    /// Writes the actions for the rows of a batch to `actions`, a row for each: NaN where the policy
    /// cannot act, as [`Policy::act`] does.
    fn act_all(&mut self, batch: &VecStep<O, I, A>, actions: &mut [A]);
}

impl<O, I, A, F> VecPolicy<O, I, A> for F
where
    O: BatchObservation,
    F: FnMut(&VecStep<O, I, A>, &mut [A]),
{
    fn act_all(&mut self, batch: &VecStep<O, I, A>, actions: &mut [A]) {
        self(batch, actions);
    }
}

/// A policy that does nothing: every action is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct ZeroPolicy;

impl<O, A: Default> Policy<O, A> for ZeroPolicy {
    fn act(&mut self, _observation: &O, action: &mut [A]) {
        action.fill_with(A::default);
    }
}

impl<O: BatchObservation, I, A: Default> VecPolicy<O, I, A> for ZeroPolicy {
    fn act_all(&mut self, _batch: &VecStep<O, I, A>, actions: &mut [A]) {
        actions.fill_with(A::default);
    }
}
