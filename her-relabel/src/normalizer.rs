//! A running mean and standard deviation, which bring observations and goals to one scale.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::scalar::Scalar;

/// Settings of a [`Normalizer`], checked by [`Normalizer::new`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalizerConfig {
    dim: usize,
    min_std: f64,
    clip: f64,
}

impl NormalizerConfig {
    /// Creates settings for vectors of `dim` elements, at least 1.
    #[must_use]
    pub const fn new(dim: usize) -> Self {
        Self { dim, min_std: 0.01, clip: 5.0 }
    }

    settings! {
        /// Sets the smallest standard deviation to divide by, positive and finite, so that an
        /// element that hardly varies is not inflated. The default, 0.01, is the paper's.
        with_min_std(min_std: f64);

        /// Sets the bound to which normalized elements are clipped, positive and finite. The
        /// default, 5, is the paper's.
        with_clip(clip: f64);

        /// Returns the number of elements of a vector.
        dim: usize;
        /// Returns the smallest standard deviation to divide by.
        min_std: f64;
        /// Returns the bound to which normalized elements are clipped.
        clip: f64;
    }
}

/// The running mean and standard deviation of vectors, element by element.
///
/// Learners normalize the inputs of a network: they [`update`](Self::update) a normalizer with
/// observations (or goals) as they arrive, [`merge`](Self::merge) the normalizers of several
/// workers, and [`normalize`](Self::normalize) batches, or [let the draw do
/// it](crate::Normalizers). A normalized element is `(x - mean) * (1 / std)`, clipped to
/// `[-clip, clip]`. The standard deviation is that of the population,
/// `sqrt(sum((x - mean)^2) / n)`, but at least `min_std`. Before the first update the mean is 0 and
/// the standard deviation 1.
///
/// Sums are kept in `f64`, as distances from the mean: large means cost no digits, and a merge is
/// as exact as one pass over all vectors. Merges in a fixed order give the same bits. A normalizer
/// loaded with serde is checked.
///
/// Sources: Plappert et al., *Multi-goal reinforcement learning*, 2018, appendix A, for the use and
/// the defaults; Chan, Golub and LeVeque, *Updating formulae and a pairwise algorithm for computing
/// sample variances*, 1979, for the merge.
///
/// # Example
/// ```
/// use her_relabel::{Normalizer, NormalizerConfig};
///
/// let mut normalizer = Normalizer::new(NormalizerConfig::new(2))?;
/// normalizer.update(&[1.0_f32, 10.0, 3.0, 30.0])?;
/// assert_eq!(normalizer.mean(), [2.0, 20.0]);
/// let mut row = [3.0_f32, 10.0];
/// normalizer.normalize(&mut row)?;
/// assert_eq!(row, [1.0, -1.0]);
/// # Ok::<(), her_relabel::NormalizerError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Saved")]
pub struct Normalizer {
    count: u64,
    pub(crate) mean: Vec<f64>,
    /// The sums of the squared distances from the mean.
    squares: Vec<f64>,
    /// One over the standard deviation of each element.
    #[serde(skip)]
    pub(crate) factors: Vec<f64>,
    min_std: f64,
    pub(crate) clip: f64,
}

/// A loaded normalizer before its checks.
#[derive(Deserialize)]
struct Saved {
    count: u64,
    mean: Vec<f64>,
    squares: Vec<f64>,
    min_std: f64,
    clip: f64,
}

impl Normalizer {
    /// Creates a normalizer that has seen no vectors.
    ///
    /// # Errors
    /// [`NormalizerError::Empty`], [`NormalizerError::BadSetting`] or
    /// [`NormalizerError::NoMemory`].
    pub fn new(config: NormalizerConfig) -> Result<Self, NormalizerError> {
        let NormalizerConfig { dim, min_std, clip } = config;
        if dim == 0 {
            return Err(NormalizerError::Empty);
        }
        for (name, value) in [("min_std", min_std), ("clip", clip)] {
            // A subnormal number has no finite reciprocal.
            if !(value > 0.0 && value.is_normal()) {
                return Err(NormalizerError::BadSetting { name, value });
            }
        }
        let filled = |value: f64| {
            let mut elements = Vec::new();
            elements.try_reserve_exact(dim).map_err(|_| NormalizerError::NoMemory { dim })?;
            elements.resize(dim, value);
            Ok(elements)
        };
        let (mean, squares, factors) = (filled(0.0)?, filled(0.0)?, filled(1.0)?);
        Ok(Self { count: 0, mean, squares, factors, min_std, clip })
    }

    /// Returns the number of elements of a vector.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.mean.len()
    }

    /// Returns the number of vectors seen.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Returns the mean of each element.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Returns the standard deviation to divide each element by, at least `min_std`.
    pub fn std(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.squares.iter().map(|squares| match self.count {
            0 => 1.0,
            count => (squares / count as f64).sqrt().max(self.min_std),
        })
    }

    /// Adds vectors, a row-major matrix of any number of rows.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`], [`NormalizerError::NotFinite`] or
    /// [`NormalizerError::TooLarge`]; then nothing has changed.
    pub fn update<T: Scalar>(&mut self, rows: &[T]) -> Result<(), NormalizerError> {
        self.check(rows)?;
        let dim = self.dim();
        let count = (rows.len() / dim) as u64;
        let zeros = vec![0.0; dim];
        let mut seen =
            Self { count, mean: zeros.clone(), squares: zeros, factors: Vec::new(), ..*self };
        // The mean comes first, so that the squares lose no digits to it.
        for row in rows.chunks_exact(dim) {
            for (mean, value) in seen.mean.iter_mut().zip(row) {
                *mean += value.to_f64() / count as f64;
            }
        }
        for row in rows.chunks_exact(dim) {
            for ((squares, mean), value) in seen.squares.iter_mut().zip(&seen.mean).zip(row) {
                *squares += (value.to_f64() - mean).powi(2);
            }
        }
        self.merge(&seen)
    }

    /// Adds the vectors that another normalizer has seen.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`] if it has different dimensions, or
    /// [`NormalizerError::TooLarge`]; then nothing has changed.
    pub fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        if other.dim() != self.dim() {
            return Err(NormalizerError::WrongLength { len: other.dim(), dim: self.dim() });
        }
        let count = self.count.checked_add(other.count).ok_or(NormalizerError::TooLarge)?;
        if other.count == 0 {
            return Ok(());
        }
        let share = other.count as f64 / count as f64;
        let mut merged = Self { count, ..self.clone() };
        let own = merged.mean.iter_mut().zip(&mut merged.squares);
        let others = other.mean.iter().zip(&other.squares);
        for ((mean, squares), (other_mean, other_squares)) in own.zip(others) {
            let distance = other_mean - *mean;
            *mean += distance * share;
            *squares += other_squares;
            *squares += distance * distance * share * self.count as f64;
        }
        if !merged.mean.iter().chain(&merged.squares).all(|value| value.is_finite()) {
            return Err(NormalizerError::TooLarge);
        }
        merged.precompute();
        *self = merged;
        Ok(())
    }

    /// Computes the factors, after every change of the sums.
    fn precompute(&mut self) {
        self.factors = self.std().map(|std| 1.0 / std).collect();
    }

    pub(crate) fn check<T: Scalar>(&self, rows: &[T]) -> Result<(), NormalizerError> {
        let (len, dim) = (rows.len(), self.dim());
        if !len.is_multiple_of(dim) {
            return Err(NormalizerError::WrongLength { len, dim });
        }
        match rows.iter().position(|value| !value.to_f64().is_finite()) {
            Some(index) => Err(NormalizerError::NotFinite { index, value: rows[index].to_f64() }),
            None => Ok(()),
        }
    }
}

impl TryFrom<Saved> for Normalizer {
    type Error = NormalizerError;

    fn try_from(saved: Saved) -> Result<Self, NormalizerError> {
        let Saved { count, mean, squares, min_std, clip } = saved;
        let empty = Self::new(NormalizerConfig { dim: mean.len(), min_std, clip })?;
        if squares.len() != mean.len() {
            return Err(NormalizerError::WrongLength { len: squares.len(), dim: mean.len() });
        }
        empty.check(&mean)?;
        empty.check(&squares)?;
        let unseen = count == 0 && mean.iter().chain(&squares).any(|value| *value != 0.0);
        if unseen || squares.iter().any(|squares| *squares < 0.0) {
            return Err(NormalizerError::Inconsistent);
        }
        let mut loaded = Self { count, mean, squares, ..empty };
        loaded.precompute();
        Ok(loaded)
    }
}

/// Error returned by a [`Normalizer`] for invalid settings or vectors.
#[derive(Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum NormalizerError {
    /// The vectors have no elements.
    #[error("vectors of length 0 have nothing to normalize: set `dim` to at least 1")]
    Empty,
    /// There is no memory for vectors of this length.
    #[error("there is no memory for vectors of {dim} elements: reduce `dim`")]
    NoMemory {
        /// The elements of a vector.
        dim: usize,
    },
    /// A matrix does not consist of whole rows, or a normalizer has different dimensions.
    #[error("{len} elements are not whole vectors of {dim}: check the dimensions")]
    WrongLength {
        /// The number of elements.
        len: usize,
        /// The elements of a vector.
        dim: usize,
    },
    /// The memory for normalized vectors and the vectors have different lengths.
    #[error("{rows} elements do not fit memory for {len}: pass memory of the same length")]
    WrongTarget {
        /// The length of the memory, in elements.
        len: usize,
        /// The number of elements.
        rows: usize,
    },
    /// An element is NaN or infinite.
    #[error(
        "element {index} is {value:?}: leave the vector out, or find the step that produced it"
    )]
    NotFinite {
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// The sums exceed `f64`.
    #[error("the sums of the vectors overflow: scale the vectors down")]
    TooLarge,
    /// A setting is not a positive, finite number, or is too small to divide by.
    #[error("`{name}` is {value:?}: use a positive, finite number, at least 1e-307")]
    BadSetting {
        /// The name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A saved normalizer has sums that no vectors can have.
    #[error("the saved sums contradict each other: use an older copy, because the data is damaged")]
    Inconsistent,
}
debug_as_display!(NormalizerError);
