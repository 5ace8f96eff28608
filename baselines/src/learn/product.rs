//! Products of matrices of `f32`, with the same bits on each processor.
//!
//! An element is `0 + l0 * r0 + l1 * r1 + ...`, from the first term to the last, where each term is
//! added by one fused multiply-add, which rounds once. A vector of the processor holds neighboring
//! elements of the result, never terms of one, so that its width does not change the order of the
//! sum.

use std::array::from_fn;
use std::ops::Range;

use pulp::{Arch, Simd, WithSimd};

/// A row-major matrix, read as it is or transposed.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    numbers: &'a [f32],
    /// The length of a row in `numbers`.
    row_len: usize,
    is_transposed: bool,
}

impl<'a> Matrix<'a> {
    /// Creates a matrix of rows of length `row_len`, at least 1.
    pub(super) const fn new(numbers: &'a [f32], row_len: usize) -> Self {
        Self { numbers, row_len, is_transposed: false }
    }

    /// Returns the same numbers with rows for columns.
    pub(super) const fn transposed(self) -> Self {
        Self { is_transposed: !self.is_transposed, ..self }
    }

    /// Returns the numbers of rows and of columns.
    const fn size(self) -> (usize, usize) {
        let (stored, row_len) = (self.numbers.len() / self.row_len, self.row_len);
        if self.is_transposed { (row_len, stored) } else { (stored, row_len) }
    }

    /// Returns a row of `numbers`.
    #[inline(always)]
    fn stored_row(self, number: usize) -> &'a [f32] {
        &self.numbers[number * self.row_len..][..self.row_len]
    }
}

/// Multiplies matrices; its memory is reused.
#[derive(Clone, Default)]
pub(super) struct Product {
    /// Some columns of the right matrix, row after row, padded with zeros.
    panel: Vec<f32>,
    /// The left matrix if it is transposed, in tiles of some of its rows, column after column.
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
        let ((num_rows, num_terms), (right_rows, num_columns)) = (left.size(), right.size());
        assert_eq!((num_terms, num_rows * num_columns), (right_rows, target.len()));
        let Self { panel, tiles } = self;
        let work = Work { left, right, target, num_rows, num_terms, num_columns, panel, tiles };
        arch.dispatch(work);
    }
}

/// A product to compute.
struct Work<'a> {
    left: Matrix<'a>,
    right: Matrix<'a>,
    target: &'a mut [f32],
    num_rows: usize,
    num_terms: usize,
    num_columns: usize,
    panel: &'a mut Vec<f32>,
    tiles: &'a mut Vec<f32>,
}

/// The rows of a tile of the result. With two vectors of each row, sums fill 16 registers of 32, or
/// 12 of 16.
const ROWS: usize = 8;
const ROWS_OF_FEW_REGISTERS: usize = 6;

/// The number of registers of processors that have many.
const MANY_REGISTERS: usize = 32;

impl WithSimd for Work<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if S::REGISTER_COUNT >= MANY_REGISTERS {
            self.write::<S, ROWS>(simd);
        } else {
            self.write::<S, ROWS_OF_FEW_REGISTERS>(simd);
        }
    }
}

impl Work<'_> {
    #[inline(always)]
    fn write<S: Simd, const R: usize>(mut self, simd: S) {
        if self.left.is_transposed {
            self.pack_left::<R>();
        }
        for first in (0..self.num_columns).step_by(2 * S::F32_LANES) {
            if self.num_columns - first > S::F32_LANES {
                self.write_columns::<S, R, 2>(simd, first);
            } else {
                self.write_columns::<S, R, 1>(simd, first);
            }
        }
    }

    /// Copies the left matrix to tiles.
    #[inline(always)]
    fn pack_left<const R: usize>(&mut self) {
        let tile_len = R * self.num_terms;
        let tiles = resized(self.tiles, self.num_rows.div_ceil(R) * tile_len);
        for (number, tile) in tiles.chunks_exact_mut(tile_len).enumerate() {
            let rows = self.left.numbers.chunks_exact(self.num_rows);
            for (to, row) in tile.as_chunks_mut::<R>().0.iter_mut().zip(rows) {
                let from = &row[number * R..];
                if let Some(whole) = from.first_chunk() {
                    *to = *whole;
                } else {
                    to[..from.len()].copy_from_slice(from);
                }
            }
        }
    }

    /// Writes `V` vectors of each row of the result, or what is left of them.
    #[inline(always)]
    fn write_columns<S: Simd, const R: usize, const V: usize>(&mut self, simd: S, first: usize) {
        let width = V * S::F32_LANES;
        let used = width.min(self.num_columns - first);
        let panel = resized(self.panel, self.num_terms * width);
        if self.right.is_transposed {
            pack_transposed(self.right, first..first + used, panel, width);
        } else {
            pack::<S, V>(self.right, first..first + used, panel);
        }
        let panel = S::as_simd_f32s(panel).0.as_chunks::<V>().0;
        for start in (0..self.num_rows).step_by(R) {
            let sums = if self.left.is_transposed {
                let tiles = self.tiles.as_chunks::<R>().0;
                tile(simd, &tiles[start / R * panel.len()..][..panel.len()], panel)
            } else {
                // The last row stands in for those that would follow it.
                let row = |i: usize| self.left.stored_row((start + i).min(self.num_rows - 1));
                let rows: [&[f32]; R] = from_fn(|i| &row(i)[..panel.len()]);
                tile(simd, rows, panel)
            };
            let mut rows = self.target.chunks_exact_mut(self.num_columns).skip(start);
            // Taken by value, the sums stay in registers.
            for sums in sums {
                let Some(row) = rows.next() else { break };
                let (vectors, rest) = S::as_mut_simd_f32s(&mut row[first..first + used]);
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

/// Some rows of a left matrix.
trait Rows<const R: usize>: Copy {
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

/// Returns the product of some rows of the left matrix and some columns of the right one.
#[inline(always)]
fn tile<S: Simd, const R: usize, const V: usize>(
    simd: S,
    rows: impl Rows<R>,
    panel: &[[S::f32s; V]],
) -> [[S::f32s; V]; R] {
    let mut sums = [[simd.splat_f32s(0.0); V]; R];
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

/// Copies columns of a matrix to rows of `V` vectors.
#[inline(always)]
fn pack<S: Simd, const V: usize>(matrix: Matrix<'_>, columns: Range<usize>, panel: &mut [f32]) {
    let rows = matrix.numbers.chunks_exact(matrix.row_len);
    for (to, row) in panel.chunks_exact_mut(V * S::F32_LANES).zip(rows) {
        let row = &row[columns.clone()];
        if let Some(whole) = S::as_simd_f32s(row).0.first_chunk::<V>() {
            S::as_mut_simd_f32s(to).0.copy_from_slice(whole);
            continue;
        }
        let (to, padding) = to.split_at_mut(row.len());
        to.copy_from_slice(row);
        padding.fill(0.0);
    }
}

/// The number of rows and columns of a block that is transposed in registers.
const BLOCK: usize = 4;

/// Copies columns of a transposed matrix to rows of length `width`.
#[inline(always)]
fn pack_transposed(matrix: Matrix<'_>, columns: Range<usize>, panel: &mut [f32], width: usize) {
    for to in panel.chunks_exact_mut(width) {
        to[columns.len()..].fill(0.0);
    }
    let whole = columns.len() / BLOCK * BLOCK;
    for at in (0..whole).step_by(BLOCK) {
        let stored: [_; BLOCK] =
            from_fn(|i| matrix.stored_row(columns.start + at + i).as_chunks::<BLOCK>());
        let blocks = stored[0].0.len();
        for (block, to) in panel.chunks_exact_mut(BLOCK * width).enumerate() {
            for (term, to) in to.chunks_exact_mut(width).enumerate() {
                let numbers: [f32; BLOCK] = from_fn(|i| stored[i].0[block][term]);
                to[at..at + BLOCK].copy_from_slice(&numbers);
            }
        }
        let rest = panel.chunks_exact_mut(width).skip(BLOCK * blocks);
        for (term, to) in rest.enumerate() {
            let numbers: [f32; BLOCK] = from_fn(|i| stored[i].1[term]);
            to[at..at + BLOCK].copy_from_slice(&numbers);
        }
    }
    for at in whole..columns.len() {
        for (to, number) in panel.chunks_exact_mut(width).zip(matrix.stored_row(columns.start + at))
        {
            to[at] = *number;
        }
    }
}

/// Returns the first `len` numbers of memory, whatever their values, and makes it longer if needed.
fn resized(memory: &mut Vec<f32>, len: usize) -> &mut [f32] {
    if memory.len() < len {
        memory.resize(len, 0.0);
    }
    &mut memory[..len]
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use pulp::Arch;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::{Matrix, Product};

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
