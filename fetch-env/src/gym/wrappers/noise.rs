//! Normal noise on observations and actions.

use super::changed_action::{ActionChange, ChangedAction};
use super::changed_vector::{ChangedVector, VectorChange};
use super::wrapper::SnapshotWrapper;
use crate::gym::error::{EnvError, check_setting};
use crate::gym::np_random::NpRandom;
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
/// observation space. The Fetch environments also have
/// [factors](crate::variation::InterfaceFactor) that draw the noise's size for each episode.
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
pub type ObservationNoise<T = f64> = ChangedVector<NoisyElements, T>;

/// The elements that get noise, and the noise.
#[derive(Clone, Debug)]
pub struct NoisyElements {
    noise: Noise,
    random: NpRandom,
    /// The indices of the elements with noise; `None` means all.
    elements: Option<Vec<usize>>,
}

impl<T> ObservationNoise<T> {
    /// Adds noise of a standard deviation from 0 to 100, in the unit of each element, where 0
    /// changes nothing.
    ///
    /// [`wrap`](super::EnvExt::wrap) refuses another. Two wrappers with different seeds have
    /// different noise in episodes with the same seed.
    #[must_use]
    pub fn new(standard_deviation: f64, seed: u64) -> Self {
        let noise = Noise::new(standard_deviation, seed);
        let random = noise.initial_state();
        Self::from_change(NoisyElements { noise, random, elements: None })
    }

    /// Adds noise to the elements at these indices alone, in this order.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::Element`] if an index is beyond the
    /// vector.
    #[must_use]
    pub fn with_elements(mut self, indices: impl IntoIterator<Item = usize>) -> Self {
        self.change.elements = Some(indices.into_iter().collect());
        self
    }
}

impl<T: Element> VectorChange<T> for NoisyElements {
    type Changed = T;

    fn attach(&mut self, observed: &BoxSpace<T>) -> Result<BoxSpace<T>, EnvError> {
        self.noise.check()?;
        let len = observed.len();
        let (mut low, mut high) = (observed.low().to_vec(), observed.high().to_vec());
        let all: Vec<usize> = (0..len).collect();
        for &index in self.elements.as_ref().unwrap_or(&all) {
            if index >= len {
                return Err(SpaceError::Element { index, len }.into());
            }
            (low[index], high[index]) = (T::NEG_INFINITY, T::INFINITY);
        }
        Ok(BoxSpace::new(observed.shape().to_vec(), low, high)?)
    }

    fn begin(&mut self, seed: Option<u64>) {
        self.noise.begin(&mut self.random, 0, seed);
    }

    fn change(&mut self, observed: &[T], _is_first: bool, changed: &mut [T]) {
        let Self { noise, random, elements } = self;
        let mut disturb =
            |element: &mut T| *element = T::from_f64(noise.disturb(random, (*element).into()));
        changed.copy_from_slice(observed);
        match elements {
            None => changed.iter_mut().for_each(disturb),
            Some(indices) => indices.iter().for_each(|&index| disturb(&mut changed[index])),
        }
    }
}

impl SnapshotWrapper for NoisyElements {
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
