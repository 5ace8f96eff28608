//! Normal noise on observations and actions.

use super::changed_action::{ActionChange, ChangedAction};
use super::macros::keep;
use super::vector::VectorObservation;
use super::vectors::Vectors;
use super::wrapper::{KeepsGoals, Resetting, SnapshotWrapper, Wrapper};
use crate::gym::env::{ActionElement, Env, Reset, Step};
use crate::gym::error::{EnvError, check_setting};
use crate::gym::np_random::NpRandom;
use crate::gym::spaces::Space;
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::spaces::error::SpaceError;

/// Normal noise. Its state is a generator.
#[derive(Clone, Copy, Debug)]
pub struct Noise {
    standard_deviation: f64,
    seed: u64,
}

impl Noise {
    pub(super) const fn new(standard_deviation: f64, seed: u64) -> Self {
        Self { standard_deviation, seed }
    }

    /// Returns an element with noise.
    fn disturb(&self, random: &mut NpRandom, element: f64) -> f64 {
        if self.standard_deviation == 0.0 {
            return element;
        }
        element + self.standard_deviation * random.standard_normal()
    }
}

impl ActionChange for Noise {
    type State = NpRandom;

    fn initial_state(&self) -> NpRandom {
        NpRandom::new(self.seed)
    }

    fn check(&self) -> Result<(), EnvError> {
        check_setting("standard_deviation", self.standard_deviation, 0.0..=100.0)
    }

    fn begin(&self, random: &mut NpRandom, _len: usize, seed: Option<u64>) {
        if let Some(seed) = seed {
            *random = self.initial_state().beside(seed);
        }
    }

    fn change(&self, random: &mut NpRandom, action: &mut [f64]) {
        action.iter_mut().for_each(|element| *element = self.disturb(random, *element));
    }

    fn check_state(&self, _random: &NpRandom, _len: usize) -> Result<(), String> {
        Ok(())
    }
}

/// Adds normal noise to each element of actions.
///
/// Its generator begins anew with each seed that is passed to a reset, so that the same seed gives
/// the same noise.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::ActionNoise};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(ActionNoise::new(0.1, 7))?;
/// env.reset(Some(0))?;
/// let noisy = env.step(&[0.0; 4])?;
/// env.reset(Some(0))?;
/// assert_eq!(env.step(&[0.0; 4])?, noisy);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type ActionNoise<T = f32> = ChangedAction<Noise, T>;

impl<T> ActionNoise<T> {
    /// Adds noise of a standard deviation from 0 to 100, where 0 changes nothing.
    /// [`wrap`](super::EnvExt::wrap) refuses another. Two wrappers with different seeds have
    /// different noise in episodes with the same seed.
    #[must_use]
    pub fn new(standard_deviation: f64, seed: u64) -> Self {
        Self::from_change(Noise::new(standard_deviation, seed))
    }
}

/// Adds normal noise to elements of the observed vector: all of them, or [some](Self::with_elements).
///
/// Goals and rewards stay exact. The generator begins anew with each seed that is passed to a reset,
/// so that the same seed gives the same noise. The elements with noise have no bounds in the
/// observation space. Observations reuse memory; a step allocates nothing unless many observations
/// are kept. The Fetch environments also have [factors](crate::variation::InterfaceFactor) that draw
/// the noise's size for each episode.
///
/// ```
/// use fetch_env::{Env, EnvExt, GoalObservation, ObservationField, Task, make_kinematic};
/// use fetch_env::wrappers::ObservationNoise;
///
/// let object = ObservationField::find(Task::Push, "object_pos").expect("a field of Push");
/// let noise = ObservationNoise::new(0.01, 7).with_elements(object.range.clone());
/// let mut env = make_kinematic("FetchPush-v4")?.wrap(noise)?;
/// let noisy = env.reset(Some(0))?.observation;
/// let exact = noisy.original().observation();
/// assert_eq!(noisy.observation()[..3], exact[..3]);
/// assert_ne!(noisy.observation()[3..6], exact[3..6]);
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug)]
pub struct ObservationNoise<T = f64> {
    noise: Noise,
    random: NpRandom,
    /// The indices of the elements with noise; `None` means all.
    elements: Option<Vec<usize>>,
    vectors: Vectors<T>,
}

impl<T: Element> ObservationNoise<T> {
    /// Adds noise of a standard deviation from 0 to 100, in the unit of each element, where 0
    /// changes nothing.
    ///
    /// [`wrap`](super::EnvExt::wrap) refuses another, and returns [`SpaceError::MissingPart`] if the
    /// observation space has no vector of the observations' type. Two wrappers with different seeds
    /// have different noise in episodes with the same seed.
    #[must_use]
    pub fn new(standard_deviation: f64, seed: u64) -> Self {
        let noise = Noise::new(standard_deviation, seed);
        Self { noise, random: noise.initial_state(), elements: None, vectors: Vectors::new() }
    }

    /// Adds noise to the elements at these indices alone, in this order.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::Element`] if an index is beyond the
    /// vector.
    #[must_use]
    pub fn with_elements(mut self, indices: impl IntoIterator<Item = usize>) -> Self {
        self.elements = Some(indices.into_iter().collect());
        self
    }

    fn make_space(&self, vector: &BoxSpace<T>) -> Result<BoxSpace<T>, SpaceError> {
        let len = vector.len();
        let (mut low, mut high) = (vector.low().to_vec(), vector.high().to_vec());
        let all: Vec<usize> = (0..len).collect();
        for &index in self.elements.as_ref().unwrap_or(&all) {
            if index >= len {
                return Err(SpaceError::Element { index, len });
            }
            (low[index], high[index]) = (T::NEG_INFINITY, T::INFINITY);
        }
        BoxSpace::new(vector.shape().to_vec(), low, high)
    }

    fn observe<O: VectorObservation<Element = T>>(
        &mut self,
        observation: O,
    ) -> Result<O::Replaced<T>, EnvError> {
        self.vectors.check(observation.vector())?;
        let Self { noise, random, elements, vectors } = self;
        let mut disturb =
            |element: &mut T| *element = T::from_f64(noise.disturb(random, (*element).into()));
        Ok(vectors.replace(observation, |vector, array| {
            array.copy_from_slice(vector);
            match elements {
                None => array.iter_mut().for_each(disturb),
                Some(indices) => indices.iter().for_each(|&index| disturb(&mut array[index])),
            }
        }))
    }
}

impl<E, O, T> Wrapper<E> for ObservationNoise<T>
where
    E: Env<Observation = O>,
    O: VectorObservation<Element = T>,
    T: Element,
{
    type Observation = O::Replaced<T>;
    keep!(Info, ActionSpace);

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        self.noise.check()?;
        let mut vectors = Vectors::new();
        vectors.attach(env, |vector| self.make_space(vector))?;
        self.vectors = vectors;
        Ok(())
    }

    fn reset(
        &mut self,
        env: &mut Resetting<'_, E>,
        seed: Option<u64>,
        options: &E::ResetOptions,
    ) -> Result<Reset<Self::Observation, E::Info>, EnvError> {
        let reset = env.reset_with(seed, options)?;
        self.noise.begin(&mut self.random, 0, seed);
        reset.try_map_observation(|observation| self.observe(observation))
    }

    fn step(
        &mut self,
        env: &mut E,
        action: &[ActionElement<E>],
    ) -> Result<Step<Self::Observation, E::Info>, EnvError> {
        env.step(action)?.try_map_observation(|observation| self.observe(observation))
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.vectors.observation_space(env)
    }
}

impl<T> KeepsGoals for ObservationNoise<T> {}

impl<T> SnapshotWrapper for ObservationNoise<T> {
    type State = NpRandom;

    fn state(&self) -> NpRandom {
        self.random.clone()
    }

    fn check_state(&self, _state: &NpRandom) -> Result<(), EnvError> {
        Ok(())
    }

    fn set_state(&mut self, state: &NpRandom) {
        self.random.clone_from(state);
    }
}
