//! What a policy is, and the two simplest.

use fetch_env::FetchObservation;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

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
    /// Forgets the last episode.
    fn reset(&mut self) {}

    /// Writes the action for an observation to `action`, which has as many elements as the action
    /// space.
    fn act(&mut self, observation: &O, action: &mut [A]);
}

impl<O, A, F: FnMut(&O, &mut [A])> Policy<O, A> for F {
    fn act(&mut self, observation: &O, action: &mut [A]) {
        self(observation, action);
    }
}

/// Draws every element of an action uniformly from [-1, 1], the action space of the Fetch tasks.
///
/// Actions come from ChaCha and the environments' resets from PCG, so that both may have the same
/// seed. In Python the same seed draws actions from the very stream that drew the goal: action and
/// goal then correlate, and the mean return of Reach is one unit too high.
#[derive(Clone, Debug)]
pub struct RandomPolicy {
    generator: ChaCha8Rng,
}

impl RandomPolicy {
    /// Returns a policy whose actions `seed` decides.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self { generator: ChaCha8Rng::seed_from_u64(seed) }
    }
}

impl<O> Policy<O> for RandomPolicy {
    fn act(&mut self, _observation: &O, action: &mut [f32]) {
        action.fill_with(|| self.generator.random_range(-1.0..=1.0));
    }
}

/// Does nothing: every action is 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct ZeroPolicy;

impl<O, A: Default> Policy<O, A> for ZeroPolicy {
    fn act(&mut self, _observation: &O, action: &mut [A]) {
        action.fill_with(A::default);
    }
}
