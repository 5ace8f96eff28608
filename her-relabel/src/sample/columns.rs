//! The columns of a batch from one table: their memory, views of their rows, and their accessors.

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
