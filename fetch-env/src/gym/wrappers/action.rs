//! Actions rescaled, clipped and repeated.

use std::num::NonZeroU32;

use super::macros::keep;
use super::wrapper::{KeepsGoals, Stateless, Wrapper};
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::{ActionElement, Env, Step};
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Takes actions between two bounds of your choice.
///
/// An action is clipped to the new bounds, and each element is then mapped linearly to the inner
/// environment's bounds, in double precision. A step allocates nothing.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::RescaleAction};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(RescaleAction::new(0.0, 10.0))?;
/// let mut plain = make_kinematic("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// plain.reset(Some(0))?;
/// assert_eq!(env.step(&[0.0, 5.0, 10.0, 7.5])?, plain.step(&[-1.0, 0.0, 1.0, 0.5])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug)]
pub struct RescaleAction<T = f32> {
    low: T,
    high: T,
    /// `None` without an environment.
    action_space: Option<BoxSpace<T>>,
    action: Vec<T>,
}

impl<T: Element> RescaleAction<T> {
    /// Rescales actions from `low` to `high`.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] unless `low < high`, both finite,
    /// and the inner environment's actions have bounds.
    #[must_use]
    pub const fn new(low: T, high: T) -> Self {
        Self { low, high, action_space: None, action: Vec::new() }
    }
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapper<E> for RescaleAction<T> {
    type ActionSpace = BoxSpace<T>;
    keep!(Observation, Info, reset);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let inner = env.action_space();
        if !inner.is_bounded() {
            return Err(SpaceError::Unbounded.into());
        }
        let (low, high) = (self.low.into(), self.high.into());
        let width = high - low;
        if !(width > 0.0 && width.is_finite()) {
            return Err(SpaceError::Bounds { low, high }.into());
        }
        self.action = vec![self.low; inner.len()];
        self.action_space = Some(BoxSpace::uniform(inner.shape().to_vec(), self.low, self.high)?);
        Ok(())
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[T],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let action_space = self.action_space.as_ref().unwrap_or_else(|| env.action_space());
        action_space.check_action(action)?;
        let ours = action_space.intervals().zip(env.action_space().intervals());
        for ((out, &element), ((low, high), (inner_low, inner_high))) in
            self.action.iter_mut().zip(action).zip(ours)
        {
            let (low, high) = (low.into(), high.into());
            let (inner_low, inner_high) = (inner_low.into(), inner_high.into());
            let share = (element.into().clamp(low, high) - low) / (high - low);
            // In low + (high - low) * share the difference could overflow; rounding can leave the
            // interval.
            let scaled = inner_low * (1.0 - share) + inner_high * share;
            *out = T::from_f64(scaled.clamp(inner_low, inner_high));
        }
        env.step(&self.action)
    }

    fn action_space<'a>(&'a self, env: &'a E) -> &'a BoxSpace<T> {
        self.action_space.as_ref().unwrap_or_else(|| env.action_space())
    }
}

impl<T> KeepsGoals for RescaleAction<T> {}
impl<T> Stateless for RescaleAction<T> {}

/// Clips actions to the action space.
///
/// The Fetch environments clip their actions themselves; this is for environments that do not. The
/// action space keeps its bounds, which Gymnasium's wrapper removes: actions beyond them are
/// accepted anyway, and samples stay useful. A step allocates nothing.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::ClipAction};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(ClipAction::new())?;
/// env.reset(Some(0))?;
/// let far = env.step(&[9.0, 0.0, 0.0, 0.0])?;
/// env.reset(Some(0))?;
/// assert_eq!(far, env.step(&[1.0, 0.0, 0.0, 0.0])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug, Default)]
pub struct ClipAction<T = f32> {
    action: Vec<T>,
}

impl<T> ClipAction<T> {
    /// Clips actions to the bounds of whichever environment is wrapped.
    #[must_use]
    pub const fn new() -> Self {
        Self { action: Vec::new() }
    }
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapper<E> for ClipAction<T> {
    keep!(Observation, Info, ActionSpace, reset);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.action = vec![T::EMPTY; env.action_space().len()];
        Ok(())
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[T],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let space = env.action_space();
        space.check_action(action)?;
        let elements = action.iter().zip(space.intervals());
        for (out, (&element, (low, high))) in self.action.iter_mut().zip(elements) {
            *out = if element < low {
                low
            } else if element > high {
                high
            } else {
                element
            };
        }
        env.step(&self.action)
    }
}

impl<T> KeepsGoals for ClipAction<T> {}
impl<T> Stateless for ClipAction<T> {}

/// Takes each action several times, or until the episode ends.
///
/// A step returns the last observation and info, and the sum of the rewards. The sum depends on
/// more than the last goals, so the environment is not a [`GoalEnv`](crate::GoalEnv). A
/// [`TimeLimit`](super::TimeLimit) outside counts actions, one inside counts repetitions. A step
/// allocates nothing.
///
/// ```
/// use std::num::NonZeroU32;
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::ActionRepeat};
///
/// let twice = NonZeroU32::MIN.saturating_add(1);
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(ActionRepeat::new(twice))?;
/// env.reset(Some(0))?;
/// assert_eq!(env.step(&[0.0; 4])?.reward, -2.0);
/// assert_eq!(env.inner().elapsed_steps(), 2);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct ActionRepeat {
    count: NonZeroU32,
}

impl ActionRepeat {
    /// Takes each action `count` times.
    #[must_use]
    pub const fn new(count: NonZeroU32) -> Self {
        Self { count }
    }
}

impl<E: Env> Wrapper<E> for ActionRepeat {
    keep!(Observation, Info, ActionSpace, reset);

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        let mut step = env.step(action)?;
        for _ in 1..self.count.get() {
            if step.is_last() {
                break;
            }
            let reward = step.reward;
            step = env.step(action)?;
            step.reward += reward;
        }
        Ok(step)
    }
}

impl Stateless for ActionRepeat {}
