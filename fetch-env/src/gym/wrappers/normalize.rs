//! Observations brought to mean 0 and variance 1.

use serde::{Deserialize, Serialize};

use super::macros::{keep, observe};
use super::vector::VectorObservation;
use super::vectors::Vectors;
use super::wrapped::Wrapped;
use super::wrapper::{KeepsGoals, SnapshotWrapper, Wrapper};
use crate::gym::env::Env;
use crate::gym::spaces::{
    Space,
    box_space::{BoxSpace, Element},
};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Normalizes the observed vectors, element by element, by their running mean and variance.
///
/// A normalized element is `(x - mean) / sqrt(variance + epsilon)`, computed in double precision
/// and rounded to `f32`. Every observation, including that of a reset, counts before it is
/// normalized, by the formulas of Gymnasium's wrapper of this name. Goals stay as they are, so that
/// hindsight relabeling still works on them. Observations reuse memory; a step allocates nothing
/// unless many observations are kept.
///
/// The statistics survive resets: until they are [frozen](Wrapped::set_frozen) the same seed gives
/// different observations later, as in Gymnasium. A snapshot contains them. Each of several
/// environments has its own; to share statistics, collect them with one and give
/// [`frozen`](Self::frozen) copies to the others.
///
/// ```
/// use fetch_env::{Env, EnvExt, make_kinematic, wrappers::NormalizeObservation};
///
/// let mut env = make_kinematic("FetchReach-v4")?.wrap(NormalizeObservation::new())?;
/// env.reset(Some(0))?;
/// for _ in 0..49 {
///     env.step(&[0.2, -0.1, 0.0, 0.0])?;
/// }
/// let statistics = env.statistics().clone();
/// assert!((statistics.count() - 50.0).abs() < 0.001);
/// let frozen = NormalizeObservation::frozen(statistics);
/// let mut evaluation = make_kinematic("FetchReach-v4")?.wrap(frozen)?;
/// assert_eq!(evaluation.reset(Some(1)), evaluation.reset(Some(1)));
/// # Ok::<(), fetch_env::EnvError>(())
/// ```
#[derive(Clone, Debug)]
pub struct NormalizeObservation {
    statistics: RunningStatistics,
    is_frozen: bool,
    vectors: Vectors<f32>,
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
    /// Creates empty statistics of vectors of `len` elements: mean 0 and variance 1, with the
    /// weight of 0.0001 vectors, as in Gymnasium.
    #[must_use]
    pub fn new(len: usize) -> Self {
        Self { count: 1e-4, mean: vec![0.0; len], variance: vec![1.0; len] }
    }

    /// Returns the number of vectors, plus 0.0001.
    #[must_use]
    pub const fn count(&self) -> f64 {
        self.count
    }

    /// Returns the mean of each element.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Returns the population variance of each element.
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

impl Default for NormalizeObservation {
    fn default() -> Self {
        Self::new()
    }
}

impl NormalizeObservation {
    /// Gymnasium's addend to the variance.
    const EPSILON: f64 = 1e-8;

    /// Normalizes observations by their own statistics, with an epsilon of 1e-8.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns [`SpaceError::MissingPart`] if the observation space
    /// has no vector of the observations' type.
    #[must_use]
    pub fn new() -> Self {
        let statistics = RunningStatistics::new(0);
        Self { statistics, is_frozen: false, vectors: Vectors::new() }
    }

    /// Normalizes observations by fixed statistics.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns the errors of [`new`](Self::new), and a [`SpaceError`]
    /// if the length of `statistics` differs from that of the observations.
    #[must_use]
    pub fn frozen(statistics: RunningStatistics) -> Self {
        Self { statistics, is_frozen: true, vectors: Vectors::new() }
    }

    fn make_space<T: Element>(
        &mut self,
        vector: &BoxSpace<T>,
    ) -> Result<BoxSpace<f32>, SpaceError> {
        let (expected, actual) = (vector.len(), self.statistics.mean.len());
        if !self.is_frozen {
            self.statistics = RunningStatistics::new(expected);
        } else if actual != expected {
            return Err(SpaceError::StatisticsLength { expected, actual });
        }
        let (low, high) = (vec![f32::NEG_INFINITY; expected], vec![f32::INFINITY; expected]);
        BoxSpace::new(vector.shape().to_vec(), low, high)
    }

    fn observe<O: VectorObservation>(
        &mut self,
        observation: O,
        _is_first: bool,
    ) -> Result<O::Replaced<f32>, EnvError> {
        self.vectors.check(observation.vector())?;
        if !self.is_frozen {
            self.statistics.add(observation.vector());
        }
        let RunningStatistics { mean, variance, .. } = &self.statistics;
        Ok(self.vectors.replace(observation, |vector, array| {
            let moments = mean.iter().zip(variance);
            for ((out, &element), (mean, variance)) in array.iter_mut().zip(vector).zip(moments) {
                *out = ((element.into() - mean) / (variance + Self::EPSILON).sqrt()) as f32;
            }
        }))
    }
}

impl<E> Wrapped<E, NormalizeObservation> {
    /// Returns the statistics of the observations so far.
    #[must_use]
    pub const fn statistics(&self) -> &RunningStatistics {
        &self.wrapper.statistics
    }

    /// Whether the statistics are frozen.
    #[must_use]
    pub const fn is_frozen(&self) -> bool {
        self.wrapper.is_frozen
    }

    /// Freezes the statistics, for evaluation, or lets them run.
    pub const fn set_frozen(&mut self, is_frozen: bool) {
        self.wrapper.is_frozen = is_frozen;
    }
}

impl<E: Env<Observation: VectorObservation>> Wrapper<E> for NormalizeObservation {
    type Observation = <E::Observation as VectorObservation>::Replaced<f32>;
    keep!(Info, ActionSpace);
    observe!();

    fn attach(&mut self, env: &E) -> Result<(), EnvError> {
        let mut vectors = Vectors::new();
        vectors.attach(env, |vector| self.make_space(vector))?;
        self.vectors = vectors;
        Ok(())
    }

    fn observation_space<'a>(&'a self, env: &'a E) -> &'a Space {
        self.vectors.observation_space(env)
    }
}

impl KeepsGoals for NormalizeObservation {}

/// The state is the statistics, and whether they are frozen.
impl SnapshotWrapper for NormalizeObservation {
    type State = (RunningStatistics, bool);

    fn state(&self) -> Self::State {
        (self.statistics.clone(), self.is_frozen)
    }

    fn check_state(&self, (statistics, _): &Self::State) -> Result<(), EnvError> {
        let (theirs, ours) = (statistics.mean.len(), self.vectors.len());
        if theirs == ours {
            return Ok(());
        }
        let reason = format!("its statistics have {theirs} elements, these have {ours}");
        Err(EnvError::ForeignSnapshot { reason })
    }

    fn set_state(&mut self, (statistics, is_frozen): &Self::State) {
        self.statistics.clone_from(statistics);
        self.is_frozen = *is_frozen;
    }
}

/// Loaded statistics, not yet checked.
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
            Err("these are not valid statistics: load what was saved".into())
        }
    }
}
