//! Copies of a few elements.

/// Copies `source` to the front of `target`, which must not be shorter.
///
/// The vectors of a transition have a few dozen elements, for which a call of `memcpy` takes longer than
/// the copy. This is compiled to plain loads and stores, whose branches depend on the length only.
#[inline(always)]
pub(crate) fn copy<T: Copy>(target: &mut [T], source: &[T]) {
    let target = &mut target[..source.len()];
    match source.len() {
        0 => {}
        1 => target[0] = source[0],
        2..4 => both_ends::<T, 2>(target, source),
        4..8 => both_ends::<T, 4>(target, source),
        len => {
            let (to, _) = target.as_chunks_mut::<8>();
            let (from, _) = source.as_chunks::<8>();
            for (to, from) in to.iter_mut().zip(from) {
                *to = *from;
            }
            if !len.is_multiple_of(8)
                && let (Some(to), Some(from)) =
                    (target.last_chunk_mut::<8>(), source.last_chunk::<8>())
            {
                *to = *from;
            }
        }
    }
}

/// Copies the first and the last `N` elements, which may overlap.
#[inline(always)]
fn both_ends<T: Copy, const N: usize>(target: &mut [T], source: &[T]) {
    if let (Some(to), Some(from)) = (target.first_chunk_mut::<N>(), source.first_chunk::<N>()) {
        *to = *from;
    }
    if let (Some(to), Some(from)) = (target.last_chunk_mut::<N>(), source.last_chunk::<N>()) {
        *to = *from;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_length_is_copied_and_nothing_more() {
        for len in 0..70_usize {
            let source: Vec<usize> = (1..=len).collect();
            let mut target = vec![0; len + 3];
            copy(&mut target, &source);
            assert_eq!(target[..len], source);
            assert_eq!(target[len..], [0; 3]);
        }
    }
}
