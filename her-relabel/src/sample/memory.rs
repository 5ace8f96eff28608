//! Memory for batches, whose size the caller chooses.

use crate::sample::sampler::SampleError;

/// Changes the length of a vector. New elements are `value`.
///
/// # Errors
/// [`SampleError::TooLarge`] if there is no memory for it; then the vector has not changed.
pub(crate) fn resize<E: Clone>(
    vector: &mut Vec<E>,
    len: usize,
    value: E,
) -> Result<(), SampleError> {
    let more = len.saturating_sub(vector.len());
    vector.try_reserve(more).map_err(|_| SampleError::TooLarge)?;
    vector.resize(len, value);
    Ok(())
}

/// Replaces the elements of a vector with `len` copies of `value`.
///
/// # Errors
/// [`SampleError::TooLarge`] if there is no memory for them.
pub(crate) fn refill<E: Clone>(
    vector: &mut Vec<E>,
    len: usize,
    value: E,
) -> Result<(), SampleError> {
    vector.clear();
    resize(vector, len, value)
}
