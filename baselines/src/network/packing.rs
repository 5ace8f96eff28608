//! Copies of matrices in the order in which a [product](super::product) reads them.

use std::array::from_fn;
use std::ops::Range;

use pulp::{Simd, WithSimd};

use super::matrix::Matrix;

/// The rows of a tile of the result. With two vectors of each row, sums fill 16 registers of 32, or
/// 12 of 16.
pub(super) const ROWS: usize = 8;
pub(super) const ROWS_OF_FEW_REGISTERS: usize = 6;

/// Returns whether a tile has [`ROWS`], not [`ROWS_OF_FEW_REGISTERS`].
#[inline(always)]
pub(super) const fn has_many_registers<S: Simd>() -> bool {
    S::REGISTER_COUNT >= 32
}

/// Copies a transposed left matrix to tiles of some of its rows, column after column.
pub(super) struct PackLeft<'a> {
    pub(super) matrix: Matrix<'a>,
    pub(super) tiles: &'a mut Vec<f32>,
}

impl WithSimd for PackLeft<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        if has_many_registers::<S>() {
            self.pack::<ROWS>();
        } else {
            self.pack::<ROWS_OF_FEW_REGISTERS>();
        }
    }
}

impl PackLeft<'_> {
    #[inline(always)]
    fn pack<const R: usize>(self) {
        let (num_rows, num_terms) = self.matrix.size();
        let tile_len = R * num_terms;
        let tiles = resized(self.tiles, num_rows.div_ceil(R) * tile_len);
        for (number, tile) in tiles.chunks_exact_mut(tile_len).enumerate() {
            let rows = self.matrix.numbers.chunks_exact(num_rows);
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
}

/// Copies columns of a right matrix to a panel: row after row, each padded with zeros to `width`.
pub(super) struct PackRight<'a> {
    pub(super) matrix: Matrix<'a>,
    pub(super) columns: Range<usize>,
    /// One vector or two.
    pub(super) width: usize,
    pub(super) panel: &'a mut [f32],
}

impl WithSimd for PackRight<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { matrix, columns, width, panel } = self;
        if matrix.is_transposed {
            pack_transposed(matrix, columns, panel, width);
        } else if width > S::F32_LANES {
            pack::<S, 2>(matrix, columns, panel);
        } else {
            pack::<S, 1>(matrix, columns, panel);
        }
    }
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
    if columns.len() < width {
        for to in panel.chunks_exact_mut(width) {
            to[columns.len()..].fill(0.0);
        }
    }
    let whole = columns.len() / BLOCK * BLOCK;
    for at in (0..whole).step_by(BLOCK) {
        let stored: [_; BLOCK] =
            from_fn(|i| matrix.stored_row(columns.start + at + i).as_chunks::<BLOCK>());
        let blocks = stored[0].0.len();
        for (block, to) in panel.chunks_exact_mut(BLOCK * width).enumerate() {
            let stored: [[f32; BLOCK]; BLOCK] = from_fn(|i| stored[i].0[block]);
            let transposed: [[f32; BLOCK]; BLOCK] = from_fn(|term| from_fn(|i| stored[i][term]));
            for (to, numbers) in to.chunks_exact_mut(width).zip(&transposed) {
                to[at..at + BLOCK].copy_from_slice(numbers);
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
pub(super) fn resized(memory: &mut Vec<f32>, len: usize) -> &mut [f32] {
    if memory.len() < len {
        memory.resize(len, 0.0);
    }
    &mut memory[..len]
}
