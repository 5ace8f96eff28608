//! Observed vectors that a wrapper changes.

use std::fmt::Debug;

use super::array::ArrayPool;
use super::macros::keep;
use super::vector::VectorObservation;
use super::wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::error::EnvError;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
    error::SpaceError,
};

/// How vectors of elements `T` change.
pub trait VectorChange<T: Element>: Debug {
    /// An element of a changed vector.
    type Changed: Element;

    /// Returns the space of the changed vectors, given that of the observed ones.
    fn attach(&mut self, observed: &BoxSpace<T>) -> Result<BoxSpace<Self::Changed>, EnvError>;

    /// Begins an episode, before its first vector.
    fn begin(&mut self, seed: Option<u64>) {
        let _ = seed;
    }

    /// Writes the changed vector. `is_first` is that of an episode.
    fn change(&mut self, observed: &[T], is_first: bool, changed: &mut [Self::Changed]);
}

/// Changes the observed vector as `C` says, into one of elements `T`: the type behind
/// [`FrameStack`](super::FrameStack), [`DelayObservation`](super::DelayObservation),
/// [`FilterObservation`](super::FilterObservation), [`ObservationNoise`](super::ObservationNoise),
/// [`TimeAwareObservation`](super::TimeAwareObservation) and
/// [`NormalizeObservation`](super::NormalizeObservation).
///
/// In goal-conditioned observations it changes the part `observation`; the goals, and so the rewards,
/// stay. Observations reuse memory; a step allocates nothing unless many observations are kept.
/// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::MissingPart`] if the observation space has no
/// vector of the observations' type.
#[derive(Clone, Debug)]
pub struct ChangedVector<C, T> {
    pub(super) change: C,
    /// The number of elements of an observed vector.
    observed_len: usize,
    /// `None` without an environment.
    observation_space: Option<Space>,
    pool: ArrayPool<T>,
}

/// Key of the vector in a goal-conditioned observation.
const OBSERVATION: &str = "observation";

impl<C, T> ChangedVector<C, T> {
    pub(super) fn from_change(change: C) -> Self {
        Self { change, observed_len: 0, observation_space: None, pool: ArrayPool::new(0) }
    }

    fn observe<O: VectorObservation>(
        &mut self,
        observation: O,
        is_first: bool,
    ) -> Result<O::Replaced<T>, EnvError>
    where
        C: VectorChange<O::Element, Changed = T>,
        T: Element,
    {
        let (expected, actual) = (self.observed_len, observation.vector().len());
        if actual != expected {
            return Err(EnvError::ObservationLength { key: OBSERVATION, expected, actual });
        }
        let Self { change, pool, .. } = self;
        let changed = pool.write(|array| change.change(observation.vector(), is_first, array));
        Ok(observation.replace(changed))
    }
}

impl<E, O, C, T> Wrapper<E> for ChangedVector<C, T>
where
    E: Env<Observation = O>,
    O: VectorObservation,
    C: VectorChange<O::Element, Changed = T>,
    T: Element,
{
    type Observation = O::Replaced<T>;
    keep!(Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let (space, element) = (env.observation_space(), std::any::type_name::<O::Element>());
        let missing = || SpaceError::MissingPart { key: OBSERVATION, element };
        let observed = O::vector_space(space).ok_or_else(missing)?;
        let changed = self.change.attach(observed)?;
        self.observed_len = observed.len();
        self.pool = ArrayPool::new(changed.len());
        self.observation_space = Some(O::replaced_space(space, changed));
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        self.change.begin(seed);
        reset.try_map_observation(|observation| self.observe(observation, true))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<Self::Observation, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|observation| self.observe(observation, false))
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.observation_space.as_ref().unwrap_or_else(|| env.observation_space())
    }
}

impl<C, T> KeepsGoals for ChangedVector<C, T> {}

impl<C: SnapshotWrapper, T> SnapshotWrapper for ChangedVector<C, T> {
    type State = C::State;

    fn state(&self) -> C::State {
        self.change.state()
    }

    fn check_state(&self, state: &C::State) -> Result<(), EnvError> {
        self.change.check_state(state)
    }

    fn set_state(&mut self, state: &C::State) {
        self.change.set_state(state);
    }
}
