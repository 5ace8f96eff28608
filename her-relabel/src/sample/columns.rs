//! The columns of a batch from one table: their memory, views of their rows, their accessors; and copies into
//! them.

use crate::scalar::Scalar;

/// The number of elements of a row in each kind of column.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Widths {
    /// 1, in a column that every batch has.
    pub(crate) always: usize,
    /// 1 if the batch has the column, else 0.
    pub(crate) n_step: usize,
    pub(crate) success: usize,
    pub(crate) priorities: usize,
    pub(crate) observation: usize,
    pub(crate) goal: usize,
    pub(crate) action: usize,
    /// The elements of all fields.
    pub(crate) fields: usize,
    /// The elements of the goals of a whole window.
    pub(crate) goals: usize,
}

/// Defines columns by a table of `name: [element; width] = what a new row holds`, where the width names one
/// of the [`Widths`]. With `pub`, each column gets an accessor of the batch, with its documentation.
macro_rules! columns {
    (pub $batch:ident { $columns:ident, $rows:ident } $table:tt) => {
        columns! { $columns, $rows $table }
        columns! { $batch $table }
    };

    ($columns:ident, $rows:ident {
        $($(#[$doc:meta])* $name:ident: [$element:ty; $width:ident] = $new:expr;)*
    }) => {
        /// The memory of some columns.
        #[derive(Clone, Debug, Default, PartialEq)]
        pub(crate) struct $columns<T> {
            $(pub(crate) $name: Vec<$element>,)*
        }

        /// Mutable views of some consecutive rows of these columns.
        pub(crate) struct $rows<'a, T> {
            $(pub(crate) $name: &'a mut [$element],)*
        }

        impl<T: Scalar> $columns<T> {
            /// Makes room for so many rows, whose contents are unspecified.
            pub(crate) fn resize(&mut self, rows: usize, widths: &Widths) -> $rows<'_, T> {
                $(self.$name.resize(rows * widths.$width, $new);)*
                $rows { $($name: &mut self.$name,)* }
            }
        }

        impl<T> $rows<'_, T> {
            /// Splits the first `rows` rows from the others.
            pub(crate) fn split_at(
                &mut self,
                rows: usize,
                widths: &Widths,
            ) -> ($rows<'_, T>, $rows<'_, T>) {
                $(let $name = self.$name.split_at_mut(rows * widths.$width);)*
                ($rows { $($name: $name.0,)* }, $rows { $($name: $name.1,)* })
            }
        }
    };

    ($batch:ident {
        $($(#[$doc:meta])* $name:ident: [$element:ty; $width:ident] = $new:expr;)*
    }) => {
        impl<T: Scalar> $batch<T> {
            $(
                $(#[$doc])*
                #[must_use]
                pub fn $name(&self) -> &[$element] {
                    &self.columns.$name
                }
            )*
        }
    };
}
pub(crate) use columns;

/// Copies a part of a transition to the row at `at` of its column.
#[inline(always)]
pub(crate) fn put_part<T: Copy>(column: &mut [T], at: usize, part: &[T]) {
    let width = part.len();
    copy(&mut column[at * width..][..width], part);
}

/// Copies `source` to `target`, which has the same length.
///
/// The vectors of a transition have a few dozen elements, for which calling `memcpy` takes longer than
/// the copy. With a known length, the copy is a handful of loads and stores.
#[inline(always)]
fn copy<T: Copy>(target: &mut [T], source: &[T]) {
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
