//! Products of matrices of `f32`, with the same bits on each processor.
//!
//! An element is `0 + l0 * r0 + l1 * r1 + ...`, from the first term to the last, where each term is
//! added by one fused multiply-add, which rounds once. A vector of the processor holds neighboring
//! elements of the result, never terms of one, so that its width does not change the order of the
//! sum.

use std::array::from_fn;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

use super::matrix::Matrix;
use super::packing::{
    PackLeft, PackRight, ROWS, ROWS_OF_FEW_REGISTERS, has_many_registers, resized,
};

/// Multiplies matrices; its memory is reused.
#[derive(Clone, Default)]
pub(super) struct Product {
    /// Some columns of the right matrix.
    panel: Vec<f32>,
    /// The left matrix if it is transposed.
    tiles: Vec<f32>,
}

impl Product {
    /// Writes the product of two matrices to a row-major matrix.
    ///
    /// # Panics
    /// Panics if the sizes of the three do not agree.
    pub(super) fn write(&mut self, left: Matrix<'_>, right: Matrix<'_>, target: &mut [f32]) {
        self.write_on(Arch::new(), left, right, target);
    }

    /// Writes the product with the instructions of a processor.
    fn write_on(&mut self, arch: Arch, left: Matrix<'_>, right: Matrix<'_>, target: &mut [f32]) {
        let Self { panel, tiles } = self;
        if left.is_transposed {
            arch.dispatch(PackLeft { matrix: left, tiles });
            write_panels(arch, Tiles { numbers: tiles, size: left.size() }, right, panel, target);
        } else {
            write_panels(arch, left, right, panel, target);
        }
    }

    /// Writes the product of a left matrix that needs no copy.
    ///
    /// # Panics
    /// Panics if the sizes of the three do not agree.
    pub(super) fn write_left(&mut self, left: impl Left, right: Matrix<'_>, target: &mut [f32]) {
        write_panels(Arch::new(), left, right, &mut self.panel, target);
    }
}

/// Writes a product, some columns at a time.
fn write_panels(
    arch: Arch,
    left: impl Left,
    right: Matrix<'_>,
    panel: &mut Vec<f32>,
    target: &mut [f32],
) {
    let ((num_rows, num_terms), (right_rows, num_columns)) = (left.size(), right.size());
    assert_eq!((num_terms, num_rows * num_columns), (right_rows, target.len()));
    let lanes = arch.dispatch(Lanes);
    for first in (0..num_columns).step_by(2 * lanes) {
        let columns = first..num_columns.min(first + 2 * lanes);
        let is_wide = columns.len() > lanes;
        let width = if is_wide { 2 * lanes } else { lanes };
        let panel = resized(panel, num_terms * width);
        arch.dispatch(PackRight { matrix: right, columns: columns.clone(), width, panel });
        let work = Work { panel, target, num_rows, num_columns, columns };
        // Each is a function of its own, in which the compiler keeps the sums in registers.
        if is_wide {
            arch.dispatch(Multiply::<_, 2> { left, work });
        } else {
            arch.dispatch(Multiply::<_, 1> { left, work });
        }
    }
}

/// Asks a processor for the number of elements of its vectors.
struct Lanes;

impl WithSimd for Lanes {
    type Output = usize;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F32_LANES
    }
}

/// Some columns of a product to compute.
struct Work<'a> {
    /// These columns of the right matrix.
    panel: &'a [f32],
    target: &'a mut [f32],
    num_rows: usize,
    num_columns: usize,
    columns: Range<usize>,
}

/// Writes `V` vectors of each row of the result, or what is left of them.
struct Multiply<'a, L, const V: usize> {
    left: L,
    work: Work<'a>,
}

impl<L: Left, const V: usize> WithSimd for Multiply<'_, L, V> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if has_many_registers::<S>() {
            self.write::<S, ROWS>(simd);
        } else {
            self.write::<S, ROWS_OF_FEW_REGISTERS>(simd);
        }
    }
}

impl<L: Left, const V: usize> Multiply<'_, L, V> {
    #[inline(always)]
    fn write<S: Simd, const R: usize>(self, simd: S) {
        let Self { left, work: Work { panel, target, num_rows, num_columns, columns } } = self;
        let panel = S::as_simd_f32s(panel).0.as_chunks::<V>().0;
        for start in (0..num_rows).step_by(R) {
            let sums: [_; R] = left.tile(simd, start, panel);
            let mut rows = target.chunks_exact_mut(num_columns).skip(start);
            // Taken by value, the sums stay in registers.
            for sums in sums {
                let Some(row) = rows.next() else { break };
                let (vectors, rest) = S::as_mut_simd_f32s(&mut row[columns.clone()]);
                if let Some(vectors) = vectors.first_chunk_mut() {
                    *vectors = sums;
                    continue;
                }
                let num_vectors = vectors.len();
                vectors.copy_from_slice(&sums[..num_vectors]);
                if !rest.is_empty() {
                    simd.partial_store_f32s(rest, sums[num_vectors]);
                }
            }
        }
    }
}

/// A left matrix: as it is, in tiles, or windows of pictures.
pub(super) trait Left: Copy {
    /// Returns the numbers of rows and of terms.
    fn size(&self) -> (usize, usize);

    /// Returns the products of the `R` rows from `start` and of the columns in a panel. Returning
    /// the rows, for one call of [`add_products`], made updates 6 % slower.
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        start: usize,
        panel: &[[S::f32s; V]],
    ) -> [[S::f32s; V]; R];
}

impl Left for Matrix<'_> {
    fn size(&self) -> (usize, usize) {
        Matrix::size(*self)
    }

    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        start: usize,
        panel: &[[S::f32s; V]],
    ) -> [[S::f32s; V]; R] {
        // The last row stands in for those that would follow it.
        let last = Matrix::size(*self).0 - 1;
        let row = |i: usize| self.stored_row((start + i).min(last));
        let rows: [&[f32]; R] = from_fn(|i| &row(i)[..panel.len()]);
        add_products(simd, rows, panel, no_sums(simd))
    }
}

/// A transposed matrix, copied by [`PackLeft`].
#[derive(Clone, Copy)]
struct Tiles<'a> {
    numbers: &'a [f32],
    size: (usize, usize),
}

impl Left for Tiles<'_> {
    fn size(&self) -> (usize, usize) {
        self.size
    }

    #[inline(always)]
    fn tile<S: Simd, const R: usize, const V: usize>(
        &self,
        simd: S,
        start: usize,
        panel: &[[S::f32s; V]],
    ) -> [[S::f32s; V]; R] {
        let tiles = self.numbers.as_chunks::<R>().0;
        let tile = &tiles[start / R * panel.len()..][..panel.len()];
        add_products(simd, tile, panel, no_sums(simd))
    }
}

/// Some rows of a left matrix.
pub(super) trait Rows<const R: usize>: Copy {
    /// Returns a column of them.
    fn column(self, term: usize) -> [f32; R];
}

impl<const R: usize> Rows<R> for [&[f32]; R] {
    #[inline(always)]
    fn column(self, term: usize) -> [f32; R] {
        from_fn(|i| self[i][term])
    }
}

/// Columns, one after the other.
impl<const R: usize> Rows<R> for &[[f32; R]] {
    #[inline(always)]
    fn column(self, term: usize) -> [f32; R] {
        self[term]
    }
}

/// Returns sums without a term.
#[inline(always)]
pub(super) fn no_sums<S: Simd, const R: usize, const V: usize>(simd: S) -> [[S::f32s; V]; R] {
    [[simd.splat_f32s(0.0); V]; R]
}

/// Adds the product of some rows of the left matrix and some columns of the right one to sums.
#[inline(always)]
pub(super) fn add_products<S: Simd, const R: usize, const V: usize>(
    simd: S,
    rows: impl Rows<R>,
    panel: &[[S::f32s; V]],
    mut sums: [[S::f32s; V]; R],
) -> [[S::f32s; V]; R] {
    for (term, right) in panel.iter().enumerate() {
        // Indexed, since the compiler may keep zipped sums in memory, which halves the speed.
        let column = rows.column(term);
        for (i, sums) in sums.iter_mut().enumerate() {
            let left = simd.splat_f32s(column[i]);
            for (v, sum) in sums.iter_mut().enumerate() {
                *sum = simd.mul_add_f32s(left, right[v], *sum);
            }
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use pulp::Arch;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::super::matrix::Matrix;
    use super::Product;

    /// The instructions of this machine's processor, and those of lesser ones.
    fn archs() -> Vec<Arch> {
        let archs = [Arch::Scalar, Arch::new()];
        #[cfg(target_arch = "x86_64")]
        let archs = archs.into_iter().chain(pulp::x86::V3::try_new().map(Arch::V3));
        archs.into_iter().collect()
    }

    /// Returns the element of a row and a column.
    fn element(matrix: Matrix<'_>, row: usize, column: usize) -> f32 {
        let (row, column) = if matrix.is_transposed { (column, row) } else { (row, column) };
        matrix.numbers[row * matrix.row_len + column]
    }

    proptest! {
        #[test]
        fn products_have_the_same_bits_on_each_processor(
            [num_rows, num_columns] in [1..30_usize, 1..100],
            num_terms in 1..40_usize,
            [left_is_transposed, right_is_transposed] in [any::<bool>(); 2],
            seed in any::<u64>(),
        ) {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut numbers = |len| -> Vec<f32> {
                (0..len).map(|_| rng.random_range(-1.0..1.0)).collect()
            };
            let (left, right) = (numbers(num_rows * num_terms), numbers(num_terms * num_columns));
            let matrix = |numbers, [num_rows, num_columns]: [usize; 2], is_transposed| {
                if is_transposed {
                    Matrix::new(numbers, num_rows).transposed()
                } else {
                    Matrix::new(numbers, num_columns)
                }
            };
            let left = matrix(&left, [num_rows, num_terms], left_is_transposed);
            let right = matrix(&right, [num_terms, num_columns], right_is_transposed);
            let mut product = Product::default();
            for arch in archs() {
                let mut target = vec![f32::NAN; num_rows * num_columns];
                product.write_on(arch, left, right, &mut target);
                for (index, number) in target.iter().enumerate() {
                    let (row, column) = (index / num_columns, index % num_columns);
                    let (mut sum, mut exact) = (0.0_f32, 0.0_f64);
                    for term in 0..num_terms {
                        let left = element(left, row, term);
                        let right = element(right, term, column);
                        sum = left.mul_add(right, sum);
                        exact += f64::from(left) * f64::from(right);
                    }
                    prop_assert_eq!(number.to_bits(), sum.to_bits(), "{:?} {}", arch, index);
                    prop_assert!((f64::from(*number) - exact).abs() < 1e-5);
                }
            }
        }
    }
}
