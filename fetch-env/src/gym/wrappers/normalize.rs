//! Observations brought to mean 0 and variance 1.

use serde::{Deserialize, Serialize};

use super::changed_vector::{ChangedVector, VectorChange};
use super::wrapped::Wrapped;
use super::wrapper::SnapshotWrapper;
use crate::gym::spaces::box_space::{BoxSpace, Element};
use crate::gym::{error::EnvError, spaces::error::SpaceError};

/// Normalizes the observed vectors, element by element, by their running mean and variance.
///
/// A normalized element is `(x - mean) / sqrt(variance + epsilon)`, computed in double precision
/// and rounded to `f32`. Every observation, including that of a reset, counts before it is
/// normalized, by the formulas of Gymnasium's wrapper of this name. Goals stay as they are, so that
/// hindsight relabeling still works on them.
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
pub type NormalizeObservation = ChangedVector<Normalize, f32>;

/// The statistics by which vectors are normalized.
#[derive(Clone, Debug)]
pub struct Normalize {
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
    /// Normalizes observations by their own statistics, with an epsilon of 1e-8.
    #[must_use]
    pub fn new() -> Self {
        let statistics = RunningStatistics::new(0);
        Self::from_change(Normalize { statistics, is_frozen: false })
    }

    /// Normalizes observations by fixed statistics.
    ///
    /// [`wrap`](super::EnvExt::wrap) returns a [`SpaceError`] if the length of `statistics` differs
    /// from that of the observations.
    #[must_use]
    pub fn frozen(statistics: RunningStatistics) -> Self {
        Self::from_change(Normalize { statistics, is_frozen: true })
    }
}

/// Gymnasium's addend to the variance.
const EPSILON: f64 = 1e-8;

impl<T: Element> VectorChange<T> for Normalize {
    type Changed = f32;

    fn attach(&mut self, observed: &BoxSpace<T>) -> Result<BoxSpace<f32>, EnvError> {
        let (expected, actual) = (observed.len(), self.statistics.mean.len());
        if !self.is_frozen {
            self.statistics = RunningStatistics::new(expected);
        } else if actual != expected {
            return Err(SpaceError::StatisticsLength { expected, actual }.into());
        }
        let (low, high) = (vec![f32::NEG_INFINITY; expected], vec![f32::INFINITY; expected]);
        Ok(BoxSpace::new(observed.shape().to_vec(), low, high)?)
    }

    fn change(&mut self, observed: &[T], _is_first: bool, normalized: &mut [f32]) {
        if !self.is_frozen {
            self.statistics.add(observed);
        }
        let RunningStatistics { mean, variance, .. } = &self.statistics;
        let moments = mean.iter().zip(variance);
        for ((out, &element), (mean, variance)) in normalized.iter_mut().zip(observed).zip(moments)
        {
            *out = ((element.into() - mean) / (variance + EPSILON).sqrt()) as f32;
        }
    }
}

impl<E> Wrapped<E, NormalizeObservation> {
    /// Returns the statistics of the observations so far.
    #[must_use]
    pub const fn statistics(&self) -> &RunningStatistics {
        &self.wrapper.change.statistics
    }

    /// Whether the statistics are frozen.
    #[must_use]
    pub const fn is_frozen(&self) -> bool {
        self.wrapper.change.is_frozen
    }

    /// Freezes the statistics, for evaluation, or lets them run.
    pub const fn set_frozen(&mut self, is_frozen: bool) {
        self.wrapper.change.is_frozen = is_frozen;
    }
}

/// The state is the statistics, and whether they are frozen.
impl SnapshotWrapper for Normalize {
    type State = (RunningStatistics, bool);

    fn state(&self) -> Self::State {
        (self.statistics.clone(), self.is_frozen)
    }

    fn check_state(&self, (statistics, _): &Self::State) -> Result<(), EnvError> {
        let (theirs, ours) = (statistics.mean.len(), self.statistics.mean.len());
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
