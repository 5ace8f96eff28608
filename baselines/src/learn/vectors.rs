//! Loops over numbers, compiled for the vectors of the processor.

use pulp::{Arch, NullaryFnOnce};

/// Runs a loop that is compiled for the widest vectors of the processor. Its result has the same
/// bits on each processor.
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
