//! Copying and widening a few elements.

use crate::scalar::Scalar;

/// Copies `source` to `target`, which has the same length.
///
/// The vectors of a transition have a few dozen elements, for which calling `memcpy` takes longer than
/// the copy. With a known length, the copy is a handful of loads and stores.
#[inline(always)]
pub(crate) fn copy<T: Copy>(target: &mut [T], source: &[T]) {
    macro_rules! by_len {
        ($($len:literal)*) => {
            match target.len() {
                0 => {}
                $($len => {
                    if let (Some(target), Some(source)) =
                        (target.first_chunk_mut::<$len>(), source.first_chunk::<$len>())
                    {
                        *target = *source;
                    }
                })*
                _ => target.copy_from_slice(source),
            }
        };
    }
    by_len!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32);
}

/// Copies `source` to `target`, which has the same length, as the `f64` that reward functions take.
#[inline(never)]
pub(crate) fn widen<T: Scalar>(target: &mut [f64], source: &[T]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target = source.to_f64();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_length_is_copied() {
        for len in 0..70_usize {
            let source: Vec<usize> = (0..len).collect();
            let mut target = vec![usize::MAX; len];
            copy(&mut target, &source);
            assert_eq!(target, source);
        }
    }
}
