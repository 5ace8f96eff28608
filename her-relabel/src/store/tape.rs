//! Rows of equal length, added at the back and dropped at the front.

use crate::scalar::Scalar;
use crate::store::block::{Block, zeroed};

/// The largest memory of a block, in bytes, unless a single row needs more. The system provides it
/// page by page when it is first written, so a large block costs nothing until it is used.
const BLOCK_BYTES: usize = 1 << 26;

/// Rows that keep their number forever. They are appended at the back, where they get consecutive
/// numbers, and dropped at the front.
///
/// Rows lie in blocks, which are allocated when first needed and reused once all their rows are
/// dropped. A tape therefore takes the memory of the most rows it ever held, never moves a row, and
/// does not allocate while its length is steady.
#[derive(Clone, Debug)]
pub(crate) struct Tape<T> {
    row_len: usize,
    /// The binary logarithm of the number of rows of a block.
    block_shift: u32,
    blocks: Vec<Block<T>>,
    /// The number of the first block.
    first_block: u64,
    /// The first kept row, and the row after the last.
    start: u64,
    end: u64,
}

impl<T: Scalar> Tape<T> {
    /// Creates an empty tape whose first row gets the number `start`. It takes several blocks if it
    /// holds more than `usual_rows` rows.
    pub(crate) fn new(row_len: usize, usual_rows: usize, start: u64) -> Self {
        let tape = Self::with_block_bytes(row_len, usual_rows, BLOCK_BYTES);
        Self { first_block: start >> tape.block_shift, start, end: start, ..tape }
    }

    fn with_block_bytes(row_len: usize, usual_rows: usize, block_bytes: usize) -> Self {
        let rows = (block_bytes / (row_len * size_of::<T>())).min(usual_rows).max(1);
        Self {
            row_len,
            block_shift: rows.ilog2(),
            blocks: Vec::new(),
            first_block: 0,
            start: 0,
            end: 0,
        }
    }

    /// Returns all rows, in order.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &[T]> {
        (self.start..self.end).map(|number| self.row(number))
    }

    /// Returns the row with this number, which must still be kept.
    #[inline(always)]
    pub(crate) fn row(&self, number: u64) -> &[T] {
        &self.rows_from(number)[..self.row_len]
    }

    /// Returns the row with this number, which must still be kept, and the rest of its block.
    #[inline(always)]
    pub(crate) fn rows_from(&self, number: u64) -> &[T] {
        debug_assert!((self.start..self.end).contains(&number));
        let (block, at) = self.place(number);
        &self.blocks[block][at..]
    }

    /// Appends rows, given as one slice.
    pub(crate) fn push_rows(&mut self, rows: &[T]) {
        let mut rest = rows;
        while !rest.is_empty() {
            let room = self.back_room();
            let (now, later) = rest.split_at(rest.len().min(room.len()));
            room[..now.len()].copy_from_slice(now);
            self.end += (now.len() / self.row_len) as u64;
            rest = later;
        }
    }

    /// Drops all rows below `start`, which is at most the number of the next row.
    pub(crate) fn drop_before(&mut self, start: u64) {
        debug_assert!(start <= self.end);
        self.start = self.start.max(start);
        while (self.first_block + 1) << self.block_shift <= self.start {
            // The block waits behind the last one until the tape reaches it.
            self.blocks.rotate_left(1);
            self.first_block += 1;
        }
    }

    /// Returns the free part of the block that the next row goes to, at least one row.
    fn back_room(&mut self) -> &mut [T] {
        let (block, at) = self.place(self.end);
        if block == self.blocks.len() {
            let elements = self.row_len << self.block_shift;
            self.blocks.push(zeroed(elements));
        }
        &mut self.blocks[block][at..]
    }

    #[inline(always)]
    fn place(&self, number: u64) -> (usize, usize) {
        let block = (number >> self.block_shift) - self.first_block;
        let row = number & ((1 << self.block_shift) - 1);
        (block as usize, row as usize * self.row_len)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Two such rows fill a block.
    const ROW_LEN: usize = 10;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(if cfg!(miri) { 4 } else { 64 }))]

        #[test]
        fn rows_keep_their_numbers(pushes in prop::collection::vec((1_u64..6, 0_u64..6), 1..12)) {
            let mut tape = Tape::<f64>::with_block_bytes(ROW_LEN, 100, 200);
            let (mut start, mut end) = (0, 0);
            let mut most = 0;
            for (pushed, dropped) in pushes {
                let rows: Vec<f64> =
                    (end..end + pushed).flat_map(|row| [row as f64; ROW_LEN]).collect();
                tape.push_rows(&rows);
                end += pushed;
                most = most.max(end - start);
                start = (start + dropped).min(end);
                tape.drop_before(start);
                for number in start..end {
                    prop_assert!(tape.row(number).iter().all(|value| *value == number as f64));
                }
                // `most` rows may begin and end inside a block.
                prop_assert!(tape.blocks.len() as u64 <= most / 2 + 1);
            }
        }
    }
}
