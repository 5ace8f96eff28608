//! Spaces of the actions that an environment takes.

use std::fmt::Debug;

use rand_core::Rng;

use crate::gym::error::EnvError;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
    discrete::{Choices, DiscreteSpace, MultiBinarySpace, MultiDiscreteSpace, fill},
    element::ArrayElement,
    error::SpaceError,
};

/// A space whose members are actions: arrays of a fixed number of elements.
///
/// ```
/// use fetch_env::{ActionSpace, Env, NpRandom, make_kinematic};
///
/// let env = make_kinematic("FetchReach-v4")?;
/// let mut action = vec![0.0; env.action_space().action_len()];
/// env.action_space().sample_action(&mut NpRandom::new(7), &mut action)?;
/// assert!(env.action_space().check_action(&action).is_ok());
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub trait ActionSpace: Clone + Debug + PartialEq + Into<Space> + Send {
    /// An element of an action: `f32` in a [`BoxSpace<f32>`], `i64` in a
    /// [`DiscreteSpace`], `bool` in a [`MultiBinarySpace`].
    type Element: ArrayElement + Default;

    /// Returns the number of elements of an action.
    fn action_len(&self) -> usize;

    /// Checks an action as [`Env::step`](crate::Env::step) does: its length, and that each element
    /// is meaningful. Numbers beyond the bounds of a box pass, because environments clip them.
    ///
    /// # Errors
    /// [`EnvError::ActionLength`], [`EnvError::ActionNotFinite`] or [`EnvError::ActionOutside`].
    fn check_action(&self, action: &[Self::Element]) -> Result<(), EnvError>;

    /// Returns elements that no action may have at `index`, such as NaN, or an integer that is not
    /// one of the choices.
    fn invalid_elements(&self, index: usize) -> Vec<Self::Element>;

    /// Draws an action and writes it to `action`.
    ///
    /// # Errors
    /// [`SpaceError::SampleLength`] if `action` does not have [`action_len`](Self::action_len)
    /// elements.
    fn sample_action<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        action: &mut [Self::Element],
    ) -> Result<(), SpaceError>;
}

impl<T: Element> ActionSpace for BoxSpace<T> {
    type Element = T;

    fn action_len(&self) -> usize {
        self.len()
    }

    fn check_action(&self, action: &[T]) -> Result<(), EnvError> {
        check_numbers(self.len(), action)
    }

    fn invalid_elements(&self, _index: usize) -> Vec<T> {
        vec![T::EMPTY, T::INFINITY, T::NEG_INFINITY]
    }

    fn sample_action<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        action: &mut [T],
    ) -> Result<(), SpaceError> {
        self.sample_into(rng, action)
    }
}

macro_rules! choices {
    ($($space:ty: |$of:ident| $choices:expr;)*) => {$(
        impl ActionSpace for $space {
            type Element = i64;

            fn action_len(&self) -> usize {
                self.len()
            }

            fn check_action(&self, action: &[i64]) -> Result<(), EnvError> {
                let $of = self;
                check_len($of.len(), action)?;
                check_choices($choices, action)
            }

            fn invalid_elements(&self, index: usize) -> Vec<i64> {
                let $of = self;
                $choices.nth(index).map_or_else(Vec::new, beyond)
            }

            fn sample_action<R: Rng + ?Sized>(
                &self,
                rng: &mut R,
                action: &mut [i64],
            ) -> Result<(), SpaceError> {
                let $of = self;
                check_sample_len($of.len(), action)?;
                for (element, choices) in action.iter_mut().zip($choices) {
                    *element = choices.sample(rng);
                }
                Ok(())
            }
        }
    )*};
}

choices! {
    DiscreteSpace: |space| std::iter::once(space.choices());
    MultiDiscreteSpace: |space| space.choices();
}

fn check_choices(choices: impl Iterator<Item = Choices>, action: &[i64]) -> Result<(), EnvError> {
    for (index, (choices, &value)) in choices.zip(action).enumerate() {
        if !choices.contains(value) {
            let (first, last) = (choices.start, choices.last());
            return Err(EnvError::ActionOutside { index, value, first, last });
        }
    }
    Ok(())
}

/// Returns the integers just outside the choices.
fn beyond(choices: Choices) -> Vec<i64> {
    let neighbors = [choices.start.checked_sub(1), choices.last().checked_add(1)];
    neighbors.into_iter().flatten().collect()
}

impl ActionSpace for MultiBinarySpace {
    type Element = bool;

    fn action_len(&self) -> usize {
        self.len()
    }

    fn check_action(&self, action: &[bool]) -> Result<(), EnvError> {
        check_len(self.len(), action)
    }

    fn invalid_elements(&self, _index: usize) -> Vec<bool> {
        Vec::new()
    }

    fn sample_action<R: Rng + ?Sized>(
        &self,
        rng: &mut R,
        action: &mut [bool],
    ) -> Result<(), SpaceError> {
        check_sample_len(self.len(), action)?;
        fill(action, rng);
        Ok(())
    }
}

/// Checks the length of an action of numbers, and that they are finite.
pub(crate) fn check_numbers<T: Element>(expected: usize, action: &[T]) -> Result<(), EnvError> {
    check_len(expected, action)?;
    let is_bad = |element: &T| !(*element).into().is_finite();
    match action.iter().position(is_bad) {
        None => Ok(()),
        Some(index) => Err(EnvError::ActionNotFinite { index, value: action[index].into() }),
    }
}

/// Checks the length of an action.
fn check_len<T>(expected: usize, action: &[T]) -> Result<(), EnvError> {
    match action.len() {
        actual if actual == expected => Ok(()),
        actual => Err(EnvError::ActionLength { expected, actual }),
    }
}

/// Checks the length of the slice for a sample.
fn check_sample_len<T>(expected: usize, action: &[T]) -> Result<(), SpaceError> {
    match action.len() {
        actual if actual == expected => Ok(()),
        actual => Err(SpaceError::SampleLength { expected, actual }),
    }
}
