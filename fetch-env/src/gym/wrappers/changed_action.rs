//! Actions that change on their way to the environment: scaled, smoothed, noisy or late.

use std::fmt::Debug;
use std::mem;

use serde::{Serialize, de::DeserializeOwned};

use super::macros::keep;
use super::wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::action_space::ActionSpace;
use crate::gym::env::{Env, Reset, Step};
use crate::gym::error::{EnvError, check_setting};
use crate::gym::spaces::box_space::{BoxSpace, Element};

/// How actions change.
pub trait ActionChange: Debug {
    /// What later changes depend on.
    type State: Clone + Debug + PartialEq + Serialize + DeserializeOwned;

    /// Returns the state before the first episode.
    fn initial_state(&self) -> Self::State;

    /// Checks the settings.
    fn check(&self) -> Result<(), EnvError>;

    /// Begins an episode of actions of `len` elements.
    fn begin(&self, state: &mut Self::State, len: usize, seed: Option<u64>);

    /// Changes an action.
    fn change(&self, state: &mut Self::State, action: &mut [f64]);

    /// Checks a state that was loaded, and says what is wrong with it.
    fn check_state(&self, state: &Self::State, len: usize) -> Result<(), String>;
}

/// Changes actions as `C` says: the type behind [`ScaleAction`], [`LowPassAction`], [`DelayAction`]
/// and [`ActionNoise`](super::ActionNoise).
///
/// An action must belong to the inner environment's space; a changed one can lie outside its bounds.
/// The Fetch environments clip it. Put another environment into a [`ClipAction`](super::ClipAction)
/// first. A step allocates nothing.
#[derive(Clone, Debug)]
pub struct ChangedAction<C: ActionChange, T = f32> {
    change: C,
    state: C::State,
    /// The state after the step that is being taken.
    next_state: C::State,
    elements: Vec<f64>,
    action: Vec<T>,
}

impl<C: ActionChange, T> ChangedAction<C, T> {
    pub(super) fn from_change(change: C) -> Self {
        let state = change.initial_state();
        let next_state = state.clone();
        Self { change, state, next_state, elements: Vec::new(), action: Vec::new() }
    }
}

impl<C: ActionChange, T: Element, E: Env<ActionSpace = BoxSpace<T>>> Wrapper<E>
    for ChangedAction<C, T>
{
    keep!(Observation, Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.change.check()?;
        let len = env.action_space().len();
        (self.elements, self.action) = (vec![0.0; len], vec![T::EMPTY; len]);
        self.change.begin(&mut self.state, len, None);
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<E::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        self.change.begin(&mut self.state, self.elements.len(), seed);
        Ok(reset)
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[T],
    ) -> Result<Step<E::Observation, E::Info>, EnvError> {
        env.action_space().check_action(action)?;
        for (element, &given) in self.elements.iter_mut().zip(action) {
            *element = given.into();
        }
        self.next_state.clone_from(&self.state);
        self.change.change(&mut self.next_state, &mut self.elements);
        let most = f64::from(f32::MAX);
        for (out, element) in self.action.iter_mut().zip(&self.elements) {
            *out = T::from_f64(element.clamp(-most, most));
        }
        let step = env.step(&self.action)?;
        // A step that the environment refuses changes nothing.
        mem::swap(&mut self.state, &mut self.next_state);
        Ok(step)
    }
}

impl<C: ActionChange, T> KeepsGoals for ChangedAction<C, T> {}

impl<C: ActionChange, T> SnapshotWrapper for ChangedAction<C, T> {
    type State = C::State;

    fn state(&self) -> C::State {
        self.state.clone()
    }

    fn check_state(&self, state: &C::State) -> Result<(), EnvError> {
        let checked = self.change.check_state(state, self.elements.len());
        checked.map_err(|reason| EnvError::ForeignSnapshot { reason })
    }

    fn set_state(&mut self, state: &C::State) {
        self.state.clone_from(state);
    }
}

/// Multiplies actions by a factor.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::ScaleAction};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(ScaleAction::new(0.5))?;
/// let mut plain = make_kinematic("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// plain.reset(Some(0))?;
/// assert_eq!(env.step(&[1.0, -0.5, 0.0, 0.0])?, plain.step(&[0.5, -0.25, 0.0, 0.0])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type ScaleAction<T = f32> = ChangedAction<Scale, T>;

/// A factor of actions.
#[derive(Clone, Copy, Debug)]
pub struct Scale(f64);

impl<T> ScaleAction<T> {
    /// Multiplies actions by `factor`, from 0 to 100. [`wrap`](super::EnvExt::wrap) refuses another.
    #[must_use]
    pub fn new(factor: f64) -> Self {
        Self::from_change(Scale(factor))
    }
}

impl ActionChange for Scale {
    type State = ();

    fn initial_state(&self) {}

    fn check(&self) -> Result<(), EnvError> {
        check_setting("factor", self.0, 0.0..=100.0)
    }

    fn begin(&self, (): &mut (), _len: usize, _seed: Option<u64>) {}

    fn change(&self, (): &mut (), action: &mut [f64]) {
        action.iter_mut().for_each(|element| *element *= self.0);
    }

    fn check_state(&self, (): &(), _len: usize) -> Result<(), String> {
        Ok(())
    }
}

/// Smooths actions: what comes out is `share * action + (1 - share) * last`, where `last` is what
/// came out before. The first action of an episode passes as it is.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::LowPassAction};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(LowPassAction::new(0.25))?;
/// let mut plain = make_kinematic("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// plain.reset(Some(0))?;
/// assert_eq!(env.step(&[1.0, 0.0, 0.0, 0.0])?, plain.step(&[1.0, 0.0, 0.0, 0.0])?);
/// assert_eq!(env.step(&[0.0; 4])?, plain.step(&[0.75, 0.0, 0.0, 0.0])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type LowPassAction<T = f32> = ChangedAction<LowPass, T>;

/// The share of an action in what comes out.
#[derive(Clone, Copy, Debug)]
pub struct LowPass(f64);

impl<T> LowPassAction<T> {
    /// Smooths actions with this share of the new one, from 0.001 to 1, where 1 changes nothing.
    /// [`wrap`](super::EnvExt::wrap) refuses another.
    #[must_use]
    pub fn new(share: f64) -> Self {
        Self::from_change(LowPass(share))
    }
}

impl ActionChange for LowPass {
    /// What came out last: nothing at the start of an episode.
    type State = Vec<f64>;

    fn initial_state(&self) -> Vec<f64> {
        Vec::new()
    }

    fn check(&self) -> Result<(), EnvError> {
        check_setting("share", self.0, 1e-3..=1.0)
    }

    fn begin(&self, last: &mut Vec<f64>, _len: usize, _seed: Option<u64>) {
        last.clear();
    }

    fn change(&self, last: &mut Vec<f64>, action: &mut [f64]) {
        if self.0 < 1.0 {
            for (element, last) in action.iter_mut().zip(&*last) {
                *element = self.0 * *element + (1.0 - self.0) * last;
            }
        }
        last.clear();
        last.extend_from_slice(action);
    }

    fn check_state(&self, last: &Vec<f64>, len: usize) -> Result<(), String> {
        if last.is_empty() { Ok(()) } else { check_elements(last, len) }
    }
}

/// Delays actions by some steps. Until the first one arrives, the environment gets zeros.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::DelayAction};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(DelayAction::new(1))?;
/// let mut plain = make_kinematic("FetchReach-v4")?;
/// env.reset(Some(0))?;
/// plain.reset(Some(0))?;
/// assert_eq!(env.step(&[1.0, 0.0, 0.0, 0.0])?, plain.step(&[0.0; 4])?);
/// assert_eq!(env.step(&[0.0; 4])?, plain.step(&[1.0, 0.0, 0.0, 0.0])?);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type DelayAction<T = f32> = ChangedAction<Delay, T>;

/// A number of steps.
#[derive(Clone, Copy, Debug)]
pub struct Delay(u8);

impl<T> DelayAction<T> {
    /// Delays actions by `steps`.
    #[must_use]
    pub fn new(steps: u8) -> Self {
        Self::from_change(Delay(steps))
    }
}

impl ActionChange for Delay {
    /// The elements of the actions that have not arrived, the next one first.
    type State = Vec<f64>;

    fn initial_state(&self) -> Vec<f64> {
        Vec::new()
    }

    fn check(&self) -> Result<(), EnvError> {
        Ok(())
    }

    fn begin(&self, late: &mut Vec<f64>, len: usize, _seed: Option<u64>) {
        late.clear();
        late.resize(usize::from(self.0) * len, 0.0);
    }

    fn change(&self, late: &mut Vec<f64>, action: &mut [f64]) {
        if late.is_empty() {
            return;
        }
        for (element, late) in action.iter_mut().zip(&mut *late) {
            mem::swap(element, late);
        }
        late.rotate_left(action.len());
    }

    fn check_state(&self, late: &Vec<f64>, len: usize) -> Result<(), String> {
        check_elements(late, usize::from(self.0) * len)
    }
}

/// Checks elements that were loaded.
fn check_elements(elements: &[f64], expected: usize) -> Result<(), String> {
    let actual = elements.len();
    if actual != expected {
        return Err(format!("its late or last actions have {actual} elements, these {expected}"));
    }
    match elements.iter().find(|element| !element.is_finite()) {
        Some(element) => Err(format!("one of its actions has the element {element}")),
        None => Ok(()),
    }
}
