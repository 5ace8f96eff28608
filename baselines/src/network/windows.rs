//! Windows of pictures, as a convolution multiplies them with its weights: matrices without a copy.

use std::array::from_fn;

use pulp::Simd;

use super::product::{Left, Rows, add_products, no_sums};

/// The windows of pictures with `channels` numbers a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Grid {
    /// Pixels of a picture, with its border.
    pub(super) height: usize,
    pub(super) width: usize,
    pub(super) channels: usize,
    /// The side of a window, in pixels.
    pub(super) kernel: usize,
    /// From one window to the next, in pixels.
    pub(super) stride: usize,
}

impl Grid {
    /// Returns the numbers of windows down and across a picture, which has at least one.
    pub(super) const fn windows(&self) -> [usize; 2] {
        let Self { height, width, kernel, stride, .. } = *self;
        [(height - kernel) / stride + 1, (width - kernel) / stride + 1]
    }

    /// Returns the length of a row of pixels, in numbers.
    pub(super) const fn row_len(&self) -> usize {
        self.width * self.channels
    }

    /// Returns the length of a picture, in numbers.
    pub(super) const fn len(&self) -> usize {
        self.height * self.row_len()
    }

    /// Returns the length of a row of a window, in numbers.
    const fn window_row_len(&self) -> usize {
        self.kernel * self.channels
    }

    /// Returns the length of a window, in numbers.
    pub(super) const fn window_len(&self) -> usize {
        self.kernel * self.window_row_len()
    }

    /// Returns where a row of windows starts among the numbers of all pictures.
    const fn row_start(&self, row: usize) -> usize {
        let [rows, _] = self.windows();
        row / rows * self.len() + row % rows * self.stride * self.row_len()
    }
}

/// A matrix with a row for each window of pictures, which lie one after the other.
#[derive(Clone, Copy)]
pub(super) struct Windows<'a> {
    pub(super) pictures: &'a [f32],
    pub(super) grid: Grid,
}

impl Windows<'_> {
    const fn num_windows(&self) -> usize {
        let [rows, columns] = self.grid.windows();
        self.pictures.len() / self.grid.len() * rows * columns
    }
}

impl Left for Windows<'_> {
    fn size(&self) -> (usize, usize) {
        (self.num_windows(), self.grid.window_len())
    }

    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        start: usize,
        panel: &[[S::f32s; V]],
    ) -> [[S::f32s; V]; R] {
        let Self { pictures, grid } = self;
        let ([_, columns], row_len) = (grid.windows(), grid.row_len());
        // The last window stands in for those that would follow it.
        let last = self.num_windows() - 1;
        let windows: [&[f32]; R] = from_fn(|i| {
            let number = (start + i).min(last);
            let column = number % columns * grid.stride * grid.channels;
            &pictures[grid.row_start(number / columns) + column..]
        });
        let mut sums = no_sums(simd);
        for (row, panel) in panel.chunks_exact(grid.window_row_len()).enumerate() {
            let rows: [&[f32]; R] = from_fn(|i| &windows[i][row * row_len..][..panel.len()]);
            sums = add_products(simd, rows, panel, sums);
        }
        sums
    }
}

/// [`Windows`] with rows for columns: a column for each window.
#[derive(Clone, Copy)]
pub(super) struct WindowsTransposed<'a>(pub(super) Windows<'a>);

impl Left for WindowsTransposed<'_> {
    fn size(&self) -> (usize, usize) {
        (self.0.grid.window_len(), self.0.num_windows())
    }

    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        start: usize,
        panel: &[[S::f32s; V]],
    ) -> [[S::f32s; V]; R] {
        let Windows { pictures, grid } = self.0;
        let last = grid.window_len() - 1;
        let places: [usize; R] = from_fn(|i| {
            let number = (start + i).min(last);
            let row_len = grid.window_row_len();
            number / row_len * grid.row_len() + number % row_len
        });
        let [_, columns] = grid.windows();
        let step = grid.stride * grid.channels;
        let rows = panel.chunks_exact(columns).enumerate();
        let mut sums = no_sums(simd);
        // Most places lie one after the other.
        if places.iter().enumerate().all(|(i, place)| *place == places[0] + i) {
            for (row, panel) in rows {
                let numbers = &pictures[grid.row_start(row) + places[0]..];
                sums = add_products(simd, Run { numbers, step }, panel, sums);
            }
        } else {
            for (row, panel) in rows {
                let numbers = &pictures[grid.row_start(row)..];
                sums = add_products(simd, Scattered { numbers, step, places }, panel, sums);
            }
        }
        sums
    }
}

/// Numbers that lie one after the other, in each window of a row of them.
#[derive(Clone, Copy)]
struct Run<'a> {
    numbers: &'a [f32],
    step: usize,
}

impl<const R: usize> Rows<R> for Run<'_> {
    #[inline(always)]
    fn column(self, term: usize) -> [f32; R] {
        let numbers = &self.numbers[term * self.step..][..R];
        from_fn(|i| numbers[i])
    }
}

/// The numbers at some places of each window of a row of them.
#[derive(Clone, Copy)]
struct Scattered<'a, const R: usize> {
    numbers: &'a [f32],
    step: usize,
    places: [usize; R],
}

impl<const R: usize> Rows<R> for Scattered<'_, R> {
    #[inline(always)]
    fn column(self, term: usize) -> [f32; R] {
        let numbers = &self.numbers[term * self.step..];
        from_fn(|i| numbers[self.places[i]])
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::matrix::Matrix;
    use super::super::product::Product;
    use super::{Grid, Windows, WindowsTransposed};

    proptest! {
        /// Products with windows have the bits of products with a matrix of their numbers.
        #[test]
        fn windows_are_a_matrix(
            [kernel, stride, channels] in [1..5_usize, 1..4, 1..9],
            [extra_height, extra_width, num_pictures] in [0..6_usize, 0..6, 1..4],
            num_columns in 1..40_usize,
            seed in any::<u64>(),
        ) {
            let (height, width) = (kernel + extra_height, kernel + extra_width);
            let grid = Grid { height, width, channels, kernel, stride };
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut numbers = |len: usize| -> Vec<f32> {
                (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
            };
            let pictures = numbers(num_pictures * grid.len());
            let windows = Windows { pictures: &pictures, grid };
            let mut matrix = Vec::new();
            let [rows, columns] = grid.windows();
            for picture in pictures.chunks_exact(grid.len()) {
                for (row, column) in (0..rows * columns).map(|at| (at / columns, at % columns)) {
                    for (y, x) in (0..kernel * kernel).map(|at| (at / kernel, at % kernel)) {
                        let (y, x) = (row * stride + y, column * stride + x);
                        let at = (y * width + x) * channels;
                        matrix.extend_from_slice(&picture[at..at + channels]);
                    }
                }
            }
            let matrix = Matrix::new(&matrix, grid.window_len());
            let (num_windows, window_len) = matrix.size();
            let mut product = Product::default();
            let right = numbers(window_len * num_columns);
            let right = Matrix::new(&right, num_columns);
            let [mut expected, mut actual] = [(); 2].map(|()| vec![0.0; num_windows * num_columns]);
            product.write(matrix, right, &mut expected);
            product.write_left(windows, right, &mut actual);
            prop_assert_eq!(expected, actual);

            let right = numbers(num_windows * num_columns);
            let right = Matrix::new(&right, num_columns);
            let [mut expected, mut actual] = [(); 2].map(|()| vec![0.0; window_len * num_columns]);
            product.write(matrix.transposed(), right, &mut expected);
            product.write_left(WindowsTransposed(windows), right, &mut actual);
            prop_assert_eq!(expected, actual);
        }
    }
}
