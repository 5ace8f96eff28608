//! Normalizing vectors by a running mean and standard deviation.

use crate::normalizer::{Normalizer, NormalizerError};
use crate::scalar::Scalar;

impl Normalizer {
    /// Normalizes vectors in place, a row-major matrix of any number of rows.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`] or [`NormalizerError::NotFinite`]; then nothing has
    /// changed.
    pub fn normalize<T: Scalar>(&self, rows: &mut [T]) -> Result<(), NormalizerError> {
        self.check(rows)?;
        for row in rows.chunks_exact_mut(self.dim()) {
            for ((value, mean), factor) in row.iter_mut().zip(&self.mean).zip(&self.factors) {
                *value = T::from_f64(self.element(value.to_f64(), *mean, *factor));
            }
        }
        Ok(())
    }

    /// Normalizes vectors, a row-major matrix of any number of rows, into memory of the same length
    /// and any element type, such as a part of a network's input.
    ///
    /// # Errors
    /// [`NormalizerError::WrongLength`], [`NormalizerError::WrongTarget`] or
    /// [`NormalizerError::NotFinite`]; then nothing has been written.
    pub fn normalize_into<S: Scalar, T: Scalar>(
        &self,
        rows: &[S],
        target: &mut [T],
    ) -> Result<(), NormalizerError> {
        self.check(rows)?;
        if rows.len() != target.len() {
            return Err(NormalizerError::WrongTarget { len: target.len(), rows: rows.len() });
        }
        let dim = self.dim();
        for (target, row) in target.chunks_exact_mut(dim).zip(rows.chunks_exact(dim)) {
            self.put(target, row);
        }
        Ok(())
    }

    /// Writes a normalized vector of finite elements, of the right length, to `target`.
    #[inline(never)]
    pub(crate) fn put<S: Scalar, T: Scalar>(&self, target: &mut [T], row: &[S]) {
        self.put_values(target, row.iter().map(|value| value.to_f64()));
    }

    /// Writes the normalized difference of two vectors of finite elements, of the right length, to
    /// `target`.
    #[inline(never)]
    pub(crate) fn put_difference<S: Scalar, G: Scalar, T: Scalar>(
        &self,
        target: &mut [T],
        row: &[G],
        subtracted: &[S],
    ) {
        self.put_values(target, difference(row, subtracted));
    }

    #[inline(always)]
    fn put_values<T: Scalar>(&self, target: &mut [T], values: impl Iterator<Item = f64>) {
        let factors = self.mean.iter().zip(&self.factors);
        for ((target, value), (mean, factor)) in target.iter_mut().zip(values).zip(factors) {
            *target = T::from_f64(self.element(value, *mean, *factor));
        }
    }

    #[inline(always)]
    fn element(&self, value: f64, mean: f64, factor: f64) -> f64 {
        let normalized = (value - mean) * factor;
        // Like `clamp`, but without its check of the bounds.
        let low = if normalized < -self.clip { -self.clip } else { normalized };
        if low > self.clip { self.clip } else { low }
    }
}

/// Returns the elements of `row` minus those of `subtracted`.
#[inline(always)]
pub(crate) fn difference<S: Scalar, G: Scalar>(
    row: &[G],
    subtracted: &[S],
) -> impl Iterator<Item = f64> {
    row.iter().zip(subtracted).map(|(value, subtracted)| value.to_f64() - subtracted.to_f64())
}
