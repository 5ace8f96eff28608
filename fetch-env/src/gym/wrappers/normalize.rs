//! Observations brought to mean 0 and variance 1.

use serde::{Deserialize, Serialize};

use super::array::ArrayPool;
use super::macros::{keep, observe};
use super::vector::{VectorObservation, check_len, vector_space};
use super::wrapped::{KeepsGoals, SnapshotWrapper, Wrapped, Wrapper};
use crate::gym::env::Env;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, wrappers::error::WrapperError};

/// An environment whose observed vectors are normalized, element by element, by their running mean
/// and variance.
///
/// A normalized element is `(x - mean) / sqrt(variance + epsilon)`, computed in double precision and
/// rounded to `f32`. Every observation, that of a reset included, counts before it is normalized,
/// by the formulas of Gymnasium's wrapper of this name. Goals stay as they are, so that hindsight
/// relabeling still works on them. Observations share memory that is used again; a step allocates
/// nothing unless many observations are kept.
///
/// The statistics survive resets: until they are [frozen](Wrapped::set_frozen) the same seed gives
/// other observations later, as it does in Gymnasium. A snapshot contains them. Each of several
/// environments has its own; to share some, collect them with one and give
/// [`frozen`](Wrapped::frozen) copies to the others.
///
/// ```
/// use fetch_env::{Env, make_kinematic, wrappers::NormalizeObservation};
///
/// let mut env = NormalizeObservation::new(make_kinematic("FetchReach-v4")?)?;
/// env.reset(Some(0))?;
/// for _ in 0..49 {
///     env.step(&[0.2, -0.1, 0.0, 0.0])?;
/// }
/// let statistics = env.statistics().clone();
/// assert!((statistics.count() - 50.0).abs() < 0.001);
/// let mut evaluation = NormalizeObservation::frozen(make_kinematic("FetchReach-v4")?, statistics)?;
/// assert_eq!(evaluation.reset(Some(1)), evaluation.reset(Some(1)));
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
pub type NormalizeObservation<E> = Wrapped<E, Normalize>;

/// The wrapper of a [`NormalizeObservation`].
#[derive(Clone, Debug)]
pub struct Normalize {
    state: NormalizeState,
    epsilon: f64,
    observation_space: Space,
    pool: ArrayPool<f32>,
}

/// The state of a [`Normalize`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NormalizeState {
    statistics: RunningStatistics,
    is_frozen: bool,
}

/// Running mean and variance of vectors, element by element.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct RunningStatistics {
    count: f64,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

/// Bounds of the statistics and of what is added to them, within which no sum overflows: neither
/// the largest variance nor the square of the largest difference, times the largest count. Beyond
/// that count, 2^53, adding 1 changes nothing.
const MAX_DELTA: f64 = 1e140;
const MAX_COUNT: f64 = (1_u64 << 53) as f64;
const MAX_MEAN: f64 = 1e200;
const MAX_VARIANCE: f64 = 1e290;

impl RunningStatistics {
    /// Creates the statistics of no vectors of `len` elements: mean 0 and variance 1, with the
    /// weight of 0.0001 vectors, as in Gymnasium.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self { count: 1e-4, mean: vec![0.0; len], variance: vec![1.0; len] }
    }

    /// The number of vectors, plus 0.0001.
    #[must_use]
    pub const fn count(&self) -> f64 {
        self.count
    }

    /// The mean of each element.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The variance of each element, that of the population.
    #[must_use]
    pub fn variance(&self) -> &[f64] {
        &self.variance
    }

    /// Adds a vector of the same length. Elements that it lacks, that are not finite or that are
    /// further than 1e140 from the mean count as the mean, so that the statistics stay finite.
    fn add<T: Element>(&mut self, vector: &[T]) {
        let count = self.count + 1.0;
        let moments = self.mean.iter_mut().zip(&mut self.variance);
        for ((mean, variance), &element) in moments.zip(vector) {
            let delta = element.into() - *mean;
            let delta = if delta.abs() <= MAX_DELTA { delta } else { 0.0 };
            let squares = *variance * self.count + delta * delta * self.count / count;
            *mean += delta / count;
            *variance = squares / count;
        }
        self.count = count;
    }
}

impl<E: Env<Observation: VectorObservation>> NormalizeObservation<E> {
    /// Gymnasium's addend to the variance.
    const EPSILON: f64 = 1e-8;

    /// Normalizes the observations of `env` by their own statistics, with `epsilon` 1e-8.
    ///
    /// # Errors
    /// [`EnvError::Vec`] if the observation space has no vector of the observations' type.
    pub fn new(env: E) -> Result<Self, EnvError> {
        let len = vector_space::<E::Observation>(env.observation_space())?.len();
        Self::with_state(env, RunningStatistics::new(len), false)
    }

    /// Normalizes the observations of `env` by statistics that stay as they are.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`EnvError::Wrapper`] if `statistics` has another length than the
    /// observations.
    pub fn frozen(env: E, statistics: RunningStatistics) -> Result<Self, EnvError> {
        Self::with_state(env, statistics, true)
    }

    fn with_state(
        env: E,
        statistics: RunningStatistics,
        is_frozen: bool,
    ) -> Result<Self, EnvError> {
        let space = env.observation_space();
        let vector = vector_space::<E::Observation>(space)?;
        let (expected, actual) = (vector.len(), statistics.mean.len());
        if actual != expected {
            return Err(WrapperError::StatisticsLength { expected, actual }.into());
        }
        let (low, high) = (vec![f32::NEG_INFINITY; expected], vec![f32::INFINITY; expected]);
        let normalized = BoxSpace::new(vector.shape().to_vec(), low, high)?;
        let observation_space = E::Observation::replaced_space(space, normalized);
        let state = NormalizeState { statistics, is_frozen };
        let (epsilon, pool) = (Self::EPSILON, ArrayPool::new(expected));
        Ok(Self::from_parts(env, Normalize { state, epsilon, observation_space, pool }))
    }
}

impl<E> NormalizeObservation<E> {
    /// The statistics of the observations so far.
    #[must_use]
    pub const fn statistics(&self) -> &RunningStatistics {
        &self.wrapper().state.statistics
    }

    /// Whether the statistics stay as they are.
    #[must_use]
    pub const fn is_frozen(&self) -> bool {
        self.wrapper().state.is_frozen
    }

    /// Freezes the statistics, for evaluation, or lets them run.
    pub const fn set_frozen(&mut self, is_frozen: bool) {
        self.wrapper.state.is_frozen = is_frozen;
    }
}

impl Normalize {
    fn observe<O: VectorObservation>(
        &mut self,
        observation: O,
        _is_first: bool,
    ) -> Result<O::Replaced<f32>, EnvError> {
        let vector = observation.vector();
        check_len(self.pool.len(), vector)?;
        let NormalizeState { statistics, is_frozen } = &mut self.state;
        if !*is_frozen {
            statistics.add(vector);
        }
        let moments = statistics.mean.iter().zip(&statistics.variance);
        let array = self.pool.write(|array| {
            for ((out, &element), (mean, variance)) in array.iter_mut().zip(vector).zip(moments) {
                *out = ((element.into() - mean) / (variance + self.epsilon).sqrt()) as f32;
            }
        });
        Ok(observation.replace(array))
    }
}

impl<E: Env<Observation: VectorObservation>> Wrapper<E> for Normalize {
    type Observation = <E::Observation as VectorObservation>::Replaced<f32>;
    keep!(Info, ActionSpace);
    observe!();

    fn observation_space<'a>(&'a self, _env: &'a E) -> &'a Space {
        &self.observation_space
    }
}

impl KeepsGoals for Normalize {}

impl SnapshotWrapper for Normalize {
    type State = NormalizeState;

    fn state(&self) -> NormalizeState {
        self.state.clone()
    }

    fn check_state(&self, state: &NormalizeState) -> Result<(), EnvError> {
        let (theirs, ours) = (state.statistics.mean.len(), self.pool.len());
        if theirs == ours {
            return Ok(());
        }
        let reason = format!("its statistics are of {theirs} elements, these of {ours}");
        Err(EnvError::ForeignSnapshot { reason })
    }

    fn set_state(&mut self, state: &NormalizeState) {
        self.state.clone_from(state);
    }
}

/// Loaded statistics before their checks.
#[derive(Deserialize)]
#[serde(rename = "RunningStatistics", deny_unknown_fields)]
struct Saved {
    count: f64,
    mean: Vec<f64>,
    variance: Vec<f64>,
}

impl TryFrom<Saved> for RunningStatistics {
    type Error = String;

    fn try_from(Saved { count, mean, variance }: Saved) -> Result<Self, String> {
        let is_valid = count > 0.0
            && count <= MAX_COUNT
            && mean.len() == variance.len()
            && mean.iter().all(|mean| mean.abs() <= MAX_MEAN)
            && variance.iter().all(|variance| (0.0..=MAX_VARIANCE).contains(variance));
        if is_valid {
            Ok(Self { count, mean, variance })
        } else {
            Err("these are no statistics: load what was saved".into())
        }
    }
}
