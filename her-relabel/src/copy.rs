//! Copies of a few elements each.

/// Copies the same part of some rows to the front of `column`, row after row: of each row the `width`
/// elements from `start` on.
///
/// The vectors of a transition have a few dozen elements, for which a call of `memcpy` takes longer than
/// the copy. This is compiled to plain loads and stores, a loop for each range of widths.
#[inline(always)]
pub(crate) fn copy_part<'a, T: Copy + 'a>(
    column: &mut [T],
    rows: impl Iterator<Item = &'a [T]>,
    (start, width): (usize, usize),
) {
    let part = rows.map(|row| &row[start..start + width]);
    match width {
        0 => {}
        1 => pairs(column, part, 1).for_each(|(target, source)| target[0] = source[0]),
        2..4 => pairs(column, part, width)
            .for_each(|(target, source)| both_ends::<T, 2>(target, source)),
        4..8 => pairs(column, part, width)
            .for_each(|(target, source)| both_ends::<T, 4>(target, source)),
        _ => pairs(column, part, width).for_each(|(target, source)| {
            let (targets, _) = target.as_chunks_mut::<8>();
            let (sources, _) = source.as_chunks::<8>();
            for (target, source) in targets.iter_mut().zip(sources) {
                *target = *source;
            }
            if let (Some(target), Some(source)) =
                (target.last_chunk_mut::<8>(), source.last_chunk::<8>())
            {
                *target = *source;
            }
        }),
    }
}

/// Each row of a column beside its source.
#[inline(always)]
fn pairs<'a, 'b, T: 'a + 'b>(
    column: &'a mut [T],
    sources: impl Iterator<Item = &'b [T]>,
    width: usize,
) -> impl Iterator<Item = (&'a mut [T], &'b [T])> {
    // The column comes second: a row that it has no source for stays as it is.
    sources.zip(column.chunks_exact_mut(width)).map(|(source, target)| (target, source))
}

/// Copies the first and the last `N` elements, which may overlap.
#[inline(always)]
fn both_ends<T: Copy, const N: usize>(target: &mut [T], source: &[T]) {
    if let (Some(target), Some(source)) = (target.first_chunk_mut::<N>(), source.first_chunk::<N>())
    {
        *target = *source;
    }
    if let (Some(target), Some(source)) = (target.last_chunk_mut::<N>(), source.last_chunk::<N>()) {
        *target = *source;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_width_is_copied_and_nothing_more() {
        for width in 0..70_usize {
            let row: Vec<usize> = (0..width + 5).collect();
            let mut column = vec![0; 3 * width];
            copy_part(&mut column, [&row[..]; 2].into_iter(), (3, width));
            let expected: Vec<usize> = (3..width + 3).collect();
            assert_eq!(column, [expected.clone(), expected, vec![0; width]].concat());
        }
    }
}
