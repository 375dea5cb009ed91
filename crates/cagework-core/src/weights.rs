//! Sparse weights: compressed sparse rows with one row per mesh vertex and one column per control.

use std::ops::Range;

use thiserror::Error;

/// A matrix of weights in compressed sparse rows (CSR), dimensionless. The weights of a vertex for the controls sum to
/// 1, except far outside the cage. Columns of [`Frames`](crate::frames::Frames) come after those of the controls.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    n_columns: u32,
    indptr: Vec<u32>,
    indices: Vec<u32>,
    data: Vec<f32>,
}

/// Reason why arrays do not form a CSR matrix.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum WeightsError {
    /// `indptr` is empty, does not start at 0, or is not ascending.
    #[error("row pointers are not ascending from 0 (at row {row})")]
    Pointers {
        /// First row with an invalid pointer.
        row: usize,
    },
    /// The last row pointer differs from the number of indices or weights.
    #[error("{indices} column indices and {data} weights do not match the last row pointer, {last}")]
    Length {
        /// Number of column indices.
        indices: usize,
        /// Number of weights.
        data: usize,
        /// Last row pointer.
        last: usize,
    },
    /// A column index is not below the number of columns.
    #[error("row {row} names column {column}, but there are {n_columns} columns")]
    Column {
        /// Index of the row with the invalid column index.
        row: usize,
        /// The column index that does not exist.
        column: u32,
        /// Number of columns of the matrix.
        n_columns: u32,
    },
    /// A row has two weights in one column.
    #[error("row {row} names column {column} twice; sum them with matrix.sum_duplicates()")]
    Duplicate {
        /// Index of the row with two weights in one column.
        row: usize,
        /// Index of the column that the row names twice.
        column: u32,
    },
    /// A weight is not a finite number.
    #[error("row {row} has a weight that is not a finite number")]
    NotFinite {
        /// Index of the row with the weight that is not finite.
        row: usize,
    },
}

impl Weights {
    /// Creates a CSR matrix from its arrays: `indptr` `[n_rows + 1]`, `indices` and `data` `[n_nonzeros]`.
    ///
    /// # Errors
    /// [`WeightsError`] if the arrays do not form a matrix with `n_columns` columns.
    pub fn new(
        n_columns: u32,
        indptr: Vec<u32>,
        indices: Vec<u32>,
        data: Vec<f32>,
    ) -> Result<Self, WeightsError> {
        if indptr.first() != Some(&0) {
            return Err(WeightsError::Pointers { row: 0 });
        }
        if let Some(row) = indptr.windows(2).position(|w| w[0] > w[1]) {
            return Err(WeightsError::Pointers { row });
        }
        let last = indptr[indptr.len() - 1] as usize;
        if indices.len() != last || data.len() != last {
            return Err(WeightsError::Length { indices: indices.len(), data: data.len(), last });
        }
        let weights = Self::from_parts(n_columns, indptr, indices, data);
        for (row, (indices, data)) in weights.rows().enumerate() {
            if let Some(&column) = indices.iter().find(|&&c| c >= n_columns) {
                return Err(WeightsError::Column { row, column, n_columns });
            }
            // Most rows are ascending and therefore without duplicates.
            if !indices.is_sorted_by(|a, b| a < b) {
                let mut sorted = indices.to_vec();
                sorted.sort_unstable();
                if let Some(twice) = sorted.windows(2).find(|w| w[0] == w[1]) {
                    return Err(WeightsError::Duplicate { row, column: twice[0] });
                }
            }
            if data.iter().any(|w| !w.is_finite()) {
                return Err(WeightsError::NotFinite { row });
            }
        }
        Ok(weights)
    }

    /// Creates a matrix from arrays that are valid by construction.
    pub(crate) fn from_parts(n_columns: u32, indptr: Vec<u32>, indices: Vec<u32>, data: Vec<f32>) -> Self {
        Self { n_columns, indptr, indices, data }
    }

    /// The arrays that [`Self::new`] takes: `indptr`, `indices` and `data`.
    #[must_use]
    pub fn into_parts(self) -> (Vec<u32>, Vec<u32>, Vec<f32>) {
        (self.indptr, self.indices, self.data)
    }

    /// The matrix whose row v is row `row_of[v]` of this one.
    #[must_use]
    pub fn with_rows(&self, row_of: &[u32]) -> Self {
        let mut indptr = Vec::with_capacity(row_of.len() + 1);
        indptr.push(0);
        let n: usize = row_of.iter().map(|&row| self.row(row as usize).0.len()).sum();
        let (mut indices, mut data) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for &row in row_of {
            let (columns, weights) = self.row(row as usize);
            indices.extend_from_slice(columns);
            data.extend_from_slice(weights);
            indptr.push(indices.len() as u32);
        }
        Self::from_parts(self.n_columns, indptr, indices, data)
    }

    /// The matrix of a range of rows.
    #[must_use]
    pub fn row_range(&self, range: Range<usize>) -> Self {
        self.with_rows(&range.map(|row| row as u32).collect::<Vec<_>>())
    }

    /// Creates a matrix without rows, with capacity for [`Self::append`].
    #[must_use]
    pub fn with_room(n_columns: u32, n_rows: usize, n_nonzeros: usize) -> Self {
        let mut indptr = Vec::with_capacity(n_rows + 1);
        indptr.push(0);
        Self::from_parts(n_columns, indptr, Vec::with_capacity(n_nonzeros), Vec::with_capacity(n_nonzeros))
    }

    /// A range of columns, renumbered from 0.
    #[must_use]
    pub fn columns(&self, range: Range<u32>) -> Self {
        let mut made = Self::with_room(range.len() as u32, self.n_rows(), 0);
        for (indices, data) in self.rows() {
            let own = indices.iter().zip(data).filter(|(c, _)| range.contains(c));
            let (indices, data): (Vec<u32>, Vec<f32>) = own.map(|(c, w)| (c - range.start, *w)).unzip();
            made.indices.extend(indices);
            made.data.extend(data);
            made.indptr.push(made.indices.len() as u32);
        }
        made
    }

    /// Horizontal concatenation: the columns of this matrix, then the columns of `more`.
    ///
    /// # Panics
    /// If the numbers of rows differ.
    #[must_use]
    pub fn beside(&self, more: &Self) -> Self {
        assert_eq!(self.n_rows(), more.n_rows(), "rows are the same");
        let n = self.n_columns;
        let mut made = Self::with_room(n + more.n_columns, self.n_rows(), self.data.len() + more.data.len());
        for ((a, x), (b, y)) in self.rows().zip(more.rows()) {
            made.indices.extend(a.iter().copied().chain(b.iter().map(|c| n + c)));
            made.data.extend(x.iter().chain(y));
            made.indptr.push(made.indices.len() as u32);
        }
        made
    }

    /// Appends the rows of another matrix.
    ///
    /// # Panics
    /// If the numbers of columns differ.
    pub fn append(&mut self, more: &Self) {
        assert_eq!(self.n_columns, more.n_columns, "columns are the same");
        let n = self.indices.len() as u32;
        self.indptr.extend(more.indptr.iter().skip(1).map(|end| n + end));
        self.indices.extend_from_slice(&more.indices);
        self.data.extend_from_slice(&more.data);
    }

    /// Size in bytes.
    #[must_use]
    pub fn bytes(&self) -> usize {
        4 * (self.indptr.len() + self.indices.len() + self.data.len())
    }

    /// Number of rows (mesh vertices).
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.indptr.len().saturating_sub(1)
    }

    /// Number of columns (controls).
    #[must_use]
    pub fn n_columns(&self) -> usize {
        self.n_columns as usize
    }

    /// Start of each row in [`Self::indices`] and [`Self::data`]. `[n_rows + 1]`
    #[must_use]
    pub fn indptr(&self) -> &[u32] {
        &self.indptr
    }

    /// Column of each stored weight. `[n_nonzeros]`
    #[must_use]
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The stored weights. `[n_nonzeros]`
    #[must_use]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// Columns and weights of a row.
    #[must_use]
    pub fn row(&self, row: usize) -> (&[u32], &[f32]) {
        let range = self.indptr[row] as usize..self.indptr[row + 1] as usize;
        (&self.indices[range.clone()], &self.data[range])
    }

    /// Weights of a column, including zeros. `[n_rows]`
    pub fn column(&self, column: u32) -> impl Iterator<Item = f32> {
        self.rows()
            .map(move |(columns, data)| columns.iter().position(|&c| c == column).map_or(0.0, |k| data[k]))
    }

    /// All rows in order.
    pub fn rows(&self) -> impl Iterator<Item = (&[u32], &[f32])> {
        (0..self.n_rows()).map(|row| self.row(row))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn appended_rows_restore_the_matrix() {
        let (indptr, indices, data) =
            (vec![0, 2, 2, 3, 5], vec![0, 2, 1, 0, 1], vec![0.5, 0.5, 1.0, 0.25, 0.75]);
        let whole = Weights::new(3, indptr, indices, data).unwrap();
        let mut made = Weights::with_room(3, 4, 5);
        for range in [0..1, 1..3, 3..4] {
            made.append(&whole.row_range(range));
        }
        assert_eq!(made, whole);
        assert_eq!(whole.columns(0..1).beside(&whole.columns(1..3)), whole);
    }
}
