//! Copies of the parts of a transition into their columns, between element types.

use crate::scalar::Scalar;

/// Copies a part of a transition to the row at `at` of its column.
#[inline(always)]
pub(crate) fn put_part<T: Copy>(column: &mut [T], at: usize, part: &[T]) {
    put_start(&mut column[at * part.len()..], part);
}

/// Copies a part of a transition to the start of a slice.
#[inline(always)]
pub(crate) fn put_start<T: Copy>(target: &mut [T], part: &[T]) {
    copy(&mut target[..part.len()], part);
}

/// Copies a goal to the start of three slices.
#[inline(always)]
pub(crate) fn put_thrice<T: Copy>(targets: [&mut [T]; 3], goal: &[T]) {
    // Most goals are positions.
    if let &[x, y, z] = goal {
        for target in targets {
            target[..3].copy_from_slice(&[x, y, z]);
        }
    } else {
        targets.into_iter().for_each(|target| put_start(target, goal));
    }
}

/// Handles the lengths up to 32 one by one: the vectors of a transition have a few dozen elements,
/// for which calling `memcpy` takes longer than the copy. With a known length, the copy is a
/// handful of loads and stores.
macro_rules! by_len {
    ($target:ident, $source:ident, $each:expr, $other:expr) => {
        by_len!(@arms $target, $source, $each, $other;
            1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32)
    };
    (@arms $target:ident, $source:ident, $each:expr, $other:expr; $($len:literal)*) => {
        match $target.len() {
            0 => {}
            $($len => {
                if let (Some(target), Some(source)) =
                    ($target.first_chunk_mut::<$len>(), $source.first_chunk::<$len>())
                {
                    $each(target, source);
                }
            })*
            _ => $other,
        }
    };
}

/// Copies `source` to `target`, which has the same length.
#[inline(always)]
fn copy<T: Copy>(target: &mut [T], source: &[T]) {
    by_len!(target, source, assign, target.copy_from_slice(source));
}

#[inline(always)]
fn assign<T: Copy, const N: usize>(target: &mut [T; N], source: &[T; N]) {
    *target = *source;
}

/// Copies a short `source` to `target`, which has the same length, as elements of the target's
/// type.
#[inline(always)]
pub(crate) fn convert_short<S: Scalar, T: Scalar>(target: &mut [T], source: &[S]) {
    by_len!(target, source, convert_array, convert(target, source));
}

#[inline(always)]
fn convert_array<S: Scalar, T: Scalar, const N: usize>(target: &mut [T; N], source: &[S; N]) {
    convert(target, source);
}

/// Copies `source` to `target`, which has the same length, as elements of the target's type.
#[inline(always)]
fn convert<S: Scalar, T: Scalar>(target: &mut [T], source: &[S]) {
    for (target, source) in target.iter_mut().zip(source) {
        *target = T::from_f64(source.to_f64());
    }
}

/// Copies `source` to `target`, which has the same length, as the `f64` that reward functions take.
#[inline(never)]
pub(crate) fn widen<T: Scalar>(target: &mut [f64], source: &[T]) {
    convert(target, source);
}

/// Puts a goal into its place among the `f64` that reward functions take.
#[inline(always)]
pub(crate) fn put_wide<T: Scalar>(goals: &mut [f64], at: usize, goal: &[T]) {
    let target = &mut goals[at * goal.len()..][..goal.len()];
    // Most goals are positions.
    if let ([x, y, z], &[from_x, from_y, from_z]) = (&mut *target, goal) {
        (*x, *y, *z) = (from_x.to_f64(), from_y.to_f64(), from_z.to_f64());
    } else {
        widen(target, goal);
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
            let wide: Vec<f64> = source.iter().map(|x| *x as f64 + 0.1).collect();
            let mut narrow = vec![f32::NAN; len];
            convert_short(&mut narrow, &wide);
            assert!(narrow.iter().zip(&wide).all(|(narrow, wide)| *narrow == *wide as f32));
        }
    }
}
