//! Loops over numbers, compiled for the vectors of the processor, and the parts of a vector.

use pulp::{Arch, NullaryFnOnce};

/// Runs a loop that is compiled for the widest vectors of the processor. Its result has the same
/// bits on each processor: the compiler neither reorders sums nor fuses operations.
///
/// `body` needs `#[inline(always)]`: code that the compiler does not inline here is compiled for
/// the oldest processors.
#[inline]
pub(crate) fn vectorize(body: impl FnMut()) {
    Arch::new().dispatch(Loop(body));
}

struct Loop<F>(F);

impl<F: FnMut()> NullaryFnOnce for Loop<F> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        (self.0)();
    }
}

/// Moves numbers a fraction of the way towards others.
pub(crate) fn follow(numbers: &mut [f32], others: &[f32], fraction: f32) {
    vectorize(
        #[inline(always)]
        || {
            for (own, other) in numbers.iter_mut().zip(others) {
                *own += fraction * (other - *own);
            }
        },
    );
}

/// Splits numbers into parts of these lengths.
pub(crate) fn parts<const N: usize>(mut numbers: &[f32], lens: [usize; N]) -> [&[f32]; N] {
    lens.map(|len| numbers.split_off(..len).unwrap_or_default())
}

/// Splits numbers into parts of these lengths.
pub(crate) fn parts_mut<const N: usize>(
    mut numbers: &mut [f32],
    lens: [usize; N],
) -> [&mut [f32]; N] {
    lens.map(|len| numbers.split_off_mut(..len).unwrap_or_default())
}
