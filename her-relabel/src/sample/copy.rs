//! Copies of a few elements.

/// Copies `source` to `target`, which is as long.
///
/// The vectors of a transition have a few dozen elements, for which a call of `memcpy` takes longer than
/// the copy. Of a length that is known it is a handful of loads and stores.
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
