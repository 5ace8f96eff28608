//! Actions rescaled, clipped and repeated.

use std::num::NonZeroU32;

use super::macros::keep;
use super::wrapped::{KeepsGoals, Stateless, Wrapped, Wrapper};
use crate::gym::env::{ActionElement, Env, Step};
use crate::gym::spaces::{
    action_space::ActionSpace,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, wrappers::error::WrapperError};

/// An environment whose actions lie between two other bounds than its own.
///
/// An action is clipped to the new bounds, and each element is then mapped linearly to the bounds of
/// the inner environment's, computed in double precision. A step allocates nothing.
///
/// ```
/// use fetch_env::{Env, make_kinematic, wrappers::RescaleAction};
///
/// let mut env = RescaleAction::new(make_kinematic("FetchReach-v4")?, 0.0, 10.0)?;
/// let mut plain = make_kinematic("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// plain.reset(Some(0))?;
/// assert_eq!(env.step(&[0.0, 5.0, 10.0, 7.5])?, plain.step(&[-1.0, 0.0, 1.0, 0.5])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type RescaleAction<E> = Wrapped<E, Rescale<ActionElement<E>>>;

/// The wrapper of a [`RescaleAction`].
#[derive(Clone, Debug)]
pub struct Rescale<T> {
    action_space: BoxSpace<T>,
    action: Vec<T>,
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapped<E, Rescale<T>> {
    /// Rescales actions from `low` to `high`.
    ///
    /// # Errors
    /// [`EnvError::Wrapper`] unless `low < high`, both finite, and the inner environment's actions
    /// have bounds.
    pub fn new(env: E, low: T, high: T) -> Result<Self, EnvError> {
        let inner = env.action_space();
        if !inner.is_bounded() {
            return Err(WrapperError::Unbounded.into());
        }
        let (shape, len) = (inner.shape().to_vec(), inner.len());
        let width = high.into() - low.into();
        if !(width > 0.0 && width.is_finite()) {
            return Err(WrapperError::Bounds { low: low.into(), high: high.into() }.into());
        }
        let action_space = BoxSpace::uniform(shape, low, high)?;
        Ok(Self::from_parts(env, Rescale { action_space, action: vec![low; len] }))
    }
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapper<E> for Rescale<T> {
    type ActionSpace = BoxSpace<T>;
    keep!(Observation, Info, reset);

    fn step(
        &mut self,
        env: &mut E,
        action: &[T],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        self.action_space.check_action(action)?;
        let ours = self.action_space.intervals().zip(env.action_space().intervals());
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

    fn action_space<'a>(&'a self, _env: &'a E) -> &'a BoxSpace<T> {
        &self.action_space
    }
}

impl<T> KeepsGoals for Rescale<T> {}
impl<T> Stateless for Rescale<T> {}

/// An environment whose actions are clipped to its action space.
///
/// The Fetch environments clip their actions themselves; this is for environments that do not. The
/// action space stays as it is, where Gymnasium's wrapper removes its bounds: actions beyond them
/// are accepted anyway, and samples stay useful. A step allocates nothing.
///
/// ```
/// use fetch_env::{Env, make_kinematic, wrappers::ClipAction};
///
/// let mut env = ClipAction::new(make_kinematic("FetchReach-v4")?);
/// env.reset(Some(0))?;
/// let far = env.step(&[9.0, 0.0, 0.0, 0.0])?;
/// env.reset(Some(0))?;
/// assert_eq!(far, env.step(&[1.0, 0.0, 0.0, 0.0])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type ClipAction<E> = Wrapped<E, Clip<ActionElement<E>>>;

/// The wrapper of a [`ClipAction`].
#[derive(Clone, Debug)]
pub struct Clip<T> {
    action: Vec<T>,
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapped<E, Clip<T>> {
    /// Clips the actions of `env`.
    #[must_use]
    pub fn new(env: E) -> Self {
        let action = vec![T::EMPTY; env.action_space().len()];
        Self::from_parts(env, Clip { action })
    }
}

impl<T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapper<E> for Clip<T> {
    keep!(Observation, Info, ActionSpace, reset);

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

impl<T> KeepsGoals for Clip<T> {}
impl<T> Stateless for Clip<T> {}

/// An environment that takes each action several times, or until the episode ends.
///
/// A step returns the last observation and info, and the sum of the rewards. The sum depends on more
/// than the last goals, so that it is no [`GoalEnv`](crate::GoalEnv). A
/// [`TimeLimit`](super::TimeLimit) outside counts actions, one inside counts repetitions. A step
/// allocates nothing.
///
/// ```
/// use std::num::NonZeroU32;
/// use fetch_env::{Env, make_kinematic, wrappers::ActionRepeat};
///
/// let twice = NonZeroU32::MIN.saturating_add(1);
/// let mut env = ActionRepeat::new(make_kinematic("FetchReach-v4")?, twice);
/// env.reset(Some(0))?;
/// assert_eq!(env.step(&[0.0; 4])?.reward, -2.0);
/// assert_eq!(env.inner().elapsed_steps(), 2);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type ActionRepeat<E> = Wrapped<E, Repeat>;

/// The wrapper of an [`ActionRepeat`].
#[derive(Clone, Copy, Debug)]
pub struct Repeat {
    count: NonZeroU32,
}

impl<E: Env> ActionRepeat<E> {
    /// Takes each action `count` times.
    #[must_use]
    pub const fn new(env: E, count: NonZeroU32) -> Self {
        Self::from_parts(env, Repeat { count })
    }
}

impl<E: Env> Wrapper<E> for Repeat {
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

impl Stateless for Repeat {}
