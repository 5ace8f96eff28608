//! Random actions of any space.

use std::any::Any;

use fetch_env::vec_env::VecStep;
use fetch_env::{ActionSpace, BatchObservation, BoxSpace, Space};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Policy, VecPolicy, error::PolicyError};

/// A policy that draws every action from an action space, as its
/// [`sample_action`](ActionSpace::sample_action) does.
///
/// Elements of a `f32` box from -1 to 1, such as those of the Fetch tasks, are drawn in single
/// precision, both bounds included.
///
/// Actions come from ChaCha and the environments' resets from PCG, so both may have the same seed.
/// In Python the same seed draws actions from the very stream that drew the goal: action and goal
/// then correlate, and the mean return of Reach is one unit too high.
///
/// ```
/// use baselines::{RandomPolicy, evaluate};
/// use fetch_env::{Env, make_kinematic};
///
/// let mut env = make_kinematic("FetchReach-v4")?;
/// let mut policy = RandomPolicy::new(env.action_space(), 7);
/// let summary = evaluate(&mut env, &mut policy, 20, 0, |_| ())?.summary()?;
/// assert!(summary.success_rate.value < 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct RandomPolicy<S = BoxSpace<f32>> {
    space: S,
    /// Whether the space is a box of `f32` from -1 to 1.
    is_unit_box: bool,
    generator: ChaCha8Rng,
}

impl<S: ActionSpace> RandomPolicy<S> {
    /// Creates a policy that draws from a space; `seed` decides its actions.
    #[must_use]
    pub fn new(space: &S, seed: u64) -> Self {
        let is_unit_box = match space.clone().into() {
            Space::BoxF32(space) => {
                space.low().iter().all(|low| *low == -1.0)
                    && space.high().iter().all(|high| *high == 1.0)
            }
            _ => false,
        };
        let generator = ChaCha8Rng::seed_from_u64(seed);
        Self { space: space.clone(), is_unit_box, generator }
    }

    /// Draws an action for each row.
    fn draw(&mut self, actions: &mut [S::Element]) {
        for row in actions.chunks_exact_mut(self.space.action_len().max(1)) {
            if self.is_unit_box {
                // The published figures of random policies come from these draws.
                let elements = row.iter_mut().map(|element| element as &mut dyn Any);
                for element in elements.filter_map(|element| element.downcast_mut::<f32>()) {
                    *element = self.generator.random_range(-1.0..=1.0);
                }
            } else {
                // The row has the length of the space, the only thing that can be wrong.
                let _ = self.space.sample_action(&mut self.generator, row);
            }
        }
    }

    fn check_action_space(&self, action_space: &Space) -> Result<(), PolicyError> {
        let expected: Space = self.space.clone().into();
        if expected == *action_space {
            return Ok(());
        }
        let actual = Box::new(action_space.clone());
        Err(PolicyError::ActionSpace { expected: Box::new(expected), actual })
    }
}

impl<O, S: ActionSpace> Policy<O, S::Element> for RandomPolicy<S> {
    fn check_spaces(
        &self,
        _observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.check_action_space(action_space)
    }

    fn act(&mut self, _observation: &O, action: &mut [S::Element]) {
        self.draw(action);
    }
}

impl<O: BatchObservation, I, S: ActionSpace> VecPolicy<O, I, S::Element> for RandomPolicy<S> {
    fn check_spaces(
        &self,
        _observation_space: &Space,
        action_space: &Space,
    ) -> Result<(), PolicyError> {
        self.check_action_space(action_space)
    }

    fn act_all(&mut self, _batch: &VecStep<O, I, S::Element>, actions: &mut [S::Element]) {
        self.draw(actions);
    }
}
