//! A running mean and standard deviation, to bring observations and goals to one scale.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::Scalar;

/// The running mean and standard deviation of vectors, element by element.
///
/// Learners normalize what a network sees: [`update`](Self::update) with observations (or goals) as they
/// come, [`merge`](Self::merge) what several workers saw, and [`normalize`](Self::normalize) batches. A
/// normalized element is `(x - mean) / std`, clipped to `[-clip, clip]`. The standard deviation is that
/// of the population, `sqrt(sum((x - mean)^2) / n)`, but never below `min_std`, so that an element that
/// hardly varies is not blown up. Before the first update the mean is 0 and the standard deviation 1.
///
/// Sums are kept in `f64`, as distances from the mean: large means cost no digits, and a merge is as exact
/// as one pass over all vectors. Merged in a fixed order, results are the same bit for bit. It can be saved
/// with serde; what is loaded is checked.
///
/// Sources: Plappert et al., *Multi-goal reinforcement learning*, 2018, appendix A, for the use and the
/// defaults; Chan, Golub and LeVeque, *Updating formulae and a pairwise algorithm for computing sample
/// variances*, 1979, for the merge.
///
/// # Example
/// ```
/// use her_relabel::Normalizer;
///
/// let mut normalizer = Normalizer::new(2)?;
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
    mean: Vec<f64>,
    /// The sums of the squared distances from the mean.
    squares: Vec<f64>,
    min_std: f64,
    clip: f64,
}

/// A normalizer that has not been checked.
#[derive(Deserialize)]
struct Saved {
    count: u64,
    mean: Vec<f64>,
    squares: Vec<f64>,
    min_std: f64,
    clip: f64,
}

impl Normalizer {
    /// A normalizer of vectors of `dim` elements, with a `min_std` of 0.01 and a `clip` of 5.
    ///
    /// # Errors
    /// [`NormalizerError::Empty`] if `dim` is 0.
    pub fn new(dim: usize) -> Result<Self, NormalizerError> {
        if dim == 0 {
            return Err(NormalizerError::Empty);
        }
        let zeros = vec![0.0; dim];
        Ok(Self { count: 0, mean: zeros.clone(), squares: zeros, min_std: 0.01, clip: 5.0 })
    }

    /// The same with another least standard deviation.
    ///
    /// # Errors
    /// [`NormalizerError::BadSetting`] if it is not a positive, finite number.
    pub fn with_min_std(mut self, min_std: f64) -> Result<Self, NormalizerError> {
        self.min_std = setting("min_std", min_std)?;
        Ok(self)
    }

    /// The same with another bound of normalized elements.
    ///
    /// # Errors
    /// [`NormalizerError::BadSetting`] if it is not a positive, finite number.
    pub fn with_clip(mut self, clip: f64) -> Result<Self, NormalizerError> {
        self.clip = setting("clip", clip)?;
        Ok(self)
    }

    /// The number of elements of a vector.
    #[must_use]
    pub fn dim(&self) -> usize {
        self.mean.len()
    }

    /// The number of vectors seen.
    #[must_use]
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The mean of each element.
    #[must_use]
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// The standard deviation that each element is divided by, at least `min_std`.
    pub fn std(&self) -> impl ExactSizeIterator<Item = f64> + '_ {
        self.squares.iter().map(|squares| match self.count {
            0 => 1.0,
            count => (squares / count as f64).sqrt().max(self.min_std),
        })
    }

    /// Takes in vectors, a row-major matrix of any number of rows.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`], [`NormalizerError::NotFinite`] or
    /// [`NormalizerError::TooLarge`]; nothing has changed then.
    pub fn update<T: Scalar>(&mut self, rows: &[T]) -> Result<(), NormalizerError> {
        self.check(rows)?;
        let dim = self.dim();
        let count = (rows.len() / dim) as u64;
        let mut seen = Self { count, ..Self::new(dim)? };
        // The mean first, so that the squares lose no digits to it.
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

    /// Takes in what another normalizer has seen.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`] if it has other dimensions, or [`NormalizerError::TooLarge`];
    /// nothing has changed then.
    pub fn merge(&mut self, other: &Self) -> Result<(), NormalizerError> {
        if other.dim() != self.dim() {
            return Err(NormalizerError::WrongLength { len: other.dim(), dim: self.dim() });
        }
        let count = self.count.checked_add(other.count).ok_or(NormalizerError::TooLarge)?;
        if other.count == 0 {
            return Ok(());
        }
        let share = other.count as f64 / count as f64;
        let distances = other.mean.iter().zip(&self.mean).map(|(other, own)| other - own);
        let distances: Vec<f64> = distances.collect();
        let mean: Vec<f64> = self
            .mean
            .iter()
            .zip(&distances)
            .map(|(own, distance)| own + distance * share)
            .collect();
        let between = |distance: f64| distance * distance * share * self.count as f64;
        let squares: Vec<f64> = self
            .squares
            .iter()
            .zip(&other.squares)
            .zip(&distances)
            .map(|((own, other), distance)| own + other + between(*distance))
            .collect();
        if !mean.iter().chain(&squares).all(|value| value.is_finite()) {
            return Err(NormalizerError::TooLarge);
        }
        (self.count, self.mean, self.squares) = (count, mean, squares);
        Ok(())
    }

    /// Normalizes vectors in place, a row-major matrix of any number of rows.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`] or [`NormalizerError::NotFinite`]; nothing has changed then.
    pub fn normalize<T: Scalar>(&self, rows: &mut [T]) -> Result<(), NormalizerError> {
        self.check(rows)?;
        for row in rows.chunks_exact_mut(self.dim()) {
            for ((value, mean), std) in row.iter_mut().zip(&self.mean).zip(self.std()) {
                let normalized = (value.to_f64() - mean) / std;
                *value = T::from_f64(normalized.clamp(-self.clip, self.clip));
            }
        }
        Ok(())
    }

    fn check<T: Scalar>(&self, rows: &[T]) -> Result<(), NormalizerError> {
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

fn setting(name: &'static str, value: f64) -> Result<f64, NormalizerError> {
    let is_good = value > 0.0 && value.is_finite();
    if is_good { Ok(value) } else { Err(NormalizerError::BadSetting { name, value }) }
}

impl TryFrom<Saved> for Normalizer {
    type Error = NormalizerError;

    fn try_from(saved: Saved) -> Result<Self, NormalizerError> {
        let Saved { count, mean, squares, min_std, clip } = saved;
        let empty = Self::new(mean.len())?.with_min_std(min_std)?.with_clip(clip)?;
        if squares.len() != mean.len() {
            return Err(NormalizerError::WrongLength { len: squares.len(), dim: mean.len() });
        }
        empty.check(&mean)?;
        empty.check(&squares)?;
        let unseen = count == 0 && mean.iter().chain(&squares).any(|value| *value != 0.0);
        if unseen || squares.iter().any(|squares| *squares < 0.0) {
            return Err(NormalizerError::Inconsistent);
        }
        Ok(Self { count, mean, squares, ..empty })
    }
}

/// What a [`Normalizer`] cannot be given.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum NormalizerError {
    /// Vectors without elements.
    #[error("there is nothing to normalize in vectors of length 0; give their length")]
    Empty,
    /// A matrix that has no whole number of rows, or a normalizer of other dimensions.
    #[error("{len} elements are no vectors of {dim}; check the dimensions")]
    WrongLength {
        /// The number of elements.
        len: usize,
        /// The elements of a vector.
        dim: usize,
    },
    /// An element is NaN or infinite.
    #[error("element {index} is {value}; leave the vector out or find the step that made it")]
    NotFinite {
        /// The element.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// Sums that are beyond `f64`.
    #[error("the vectors are so large that their sums overflow; scale them down")]
    TooLarge,
    /// A setting that makes no sense.
    #[error("`{name}` is {value}; it must be a positive number")]
    BadSetting {
        /// The name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A saved normalizer with sums that no vectors have.
    #[error("the saved sums contradict each other; the data is damaged")]
    Inconsistent,
}
