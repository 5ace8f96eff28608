//! The columns of a batch from one table: their memory, views of their rows, their accessors.

use goal_reward::Dims;

use crate::sample::error::SampleError;
use crate::sample::settings::sampler::Sampler;
use crate::store::layout::Layout;
use crate::unit_interval::UnitInterval;

/// The number of elements of a row in each kind of column; 0 if the batch has none.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Widths {
    /// 1, in a column that every batch has.
    pub(crate) always: usize,
    /// 1 if the batch has the column, else 0.
    pub(crate) discount: usize,
    pub(crate) success: usize,
    pub(crate) priorities: usize,
    /// Of an observation that is not followed by the goal.
    pub(crate) observation: usize,
    /// Of an observation followed by the goal.
    pub(crate) input: usize,
    pub(crate) goal: usize,
    pub(crate) action: usize,
    /// The elements of all fields.
    pub(crate) fields: usize,
    /// The elements of the goals of a whole window.
    pub(crate) goals: usize,
    /// The elements of a goal whose success is judged apart from the columns.
    pub(crate) judged: usize,
    /// The elements of a state and a goal that are mirrored.
    pub(crate) mirrored: usize,
}

impl Widths {
    /// Returns the widths of the columns that a batch of `sampler` has, whose rows have at most
    /// `window` steps. `keeps_stored` says whether the columns hold the goals as they are stored.
    pub(crate) fn of(
        sampler: &Sampler,
        layout: &Layout,
        window: usize,
        keeps_stored: bool,
    ) -> Self {
        let Dims { observation, goal, action } = layout.dims();
        let is_joined = sampler.joined_goal().is_some();
        Self {
            always: 1,
            discount: usize::from(sampler.n_step().is_some()),
            success: usize::from(sampler.success()),
            priorities: usize::from(sampler.priorities().is_some()),
            observation: if is_joined { 0 } else { observation },
            input: if is_joined { observation + goal } else { 0 },
            goal,
            action,
            fields: layout.fields().len(),
            goals: goal * window,
            judged: if sampler.success() && !keeps_stored { goal } else { 0 },
            mirrored: if sampler.mirrored() == UnitInterval::ZERO {
                0
            } else {
                layout.state().end + goal
            },
        }
    }
}

/// Defines columns by a table of `name: [element; width] = what a new row holds, documentation`,
/// where the width names one of the [`Widths`], and the documentation is a noun phrase without
/// article. With the name of a batch before the table, each column gets an accessor of the batch.
macro_rules! column_table {
    ($batch:ident: { $($types:tt)* } {
        $($name:ident: [$element:ty; $width:ident] = $new:expr, $doc:expr;)*
    }) => {
        column_table! { { $($types)* } { $($name: [$element; $width] = $new, $doc;)* } }

        impl<T: Scalar> $batch<T> {
            $(
                #[doc = concat!("Returns the ", $doc)]
                #[must_use]
                pub fn $name(&self) -> &[$element] {
                    &self.columns.$name
                }
            )*
        }

        impl<T> $batch<T> {
            /// Removes all rows from the columns, and keeps the memory.
            fn clear_columns(&mut self) {
                $(self.columns.$name.clear();)*
            }
        }
    };

    ({
        $(#[$columns_doc:meta])* $vis:vis struct $columns:ident;
        $(#[$rows_doc:meta])* $rows_vis:vis struct $rows:ident;
    } {
        $($name:ident: [$element:ty; $width:ident] = $new:expr, $doc:expr;)*
    }) => {
        $(#[$columns_doc])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[non_exhaustive]
        $vis struct $columns<T> {
            $(
                #[doc = concat!("The ", $doc)]
                $vis $name: Vec<$element>,
            )*
        }

        $(#[$rows_doc])*
        #[derive(Debug, Default)]
        $rows_vis struct $rows<'a, T> {
            $(
                #[doc = concat!("The ", $doc)]
                $rows_vis $name: &'a mut [$element],
            )*
        }

        impl<'a, T: Scalar> $columns<T> {
            /// Makes room for `rows` rows with unspecified contents: in `given`, for the columns
            /// that it has memory for.
            pub(crate) fn resize(
                &'a mut self,
                rows: usize,
                widths: &Widths,
                given: $rows<'a, T>,
            ) -> Result<$rows<'a, T>, SampleError> {
                $(
                    let len = rows * widths.$width;
                    let $name = if given.$name.is_empty() {
                        resize(&mut self.$name, len, $new)?;
                        &mut self.$name[..]
                    } else if given.$name.len() == len {
                        self.$name.clear();
                        given.$name
                    } else {
                        return Err(SampleError::WrongLength {
                            column: stringify!($name),
                            expected: len,
                            actual: given.$name.len(),
                        });
                    };
                )*
                Ok($rows { $($name,)* })
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
}
pub(crate) use column_table;

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
