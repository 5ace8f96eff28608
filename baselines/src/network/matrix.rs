//! Matrices that a [product](super::product) reads.

/// A row-major matrix, read as it is or transposed.
#[derive(Clone, Copy)]
pub(super) struct Matrix<'a> {
    pub(super) numbers: &'a [f32],
    /// The length of a row in `numbers`.
    pub(super) row_len: usize,
    pub(super) is_transposed: bool,
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
    pub(super) const fn size(self) -> (usize, usize) {
        let (stored, row_len) = (self.numbers.len() / self.row_len, self.row_len);
        if self.is_transposed { (row_len, stored) } else { (stored, row_len) }
    }

    /// Returns a row of `numbers`.
    #[inline(always)]
    pub(super) fn stored_row(self, number: usize) -> &'a [f32] {
        &self.numbers[number * self.row_len..][..self.row_len]
    }
}
