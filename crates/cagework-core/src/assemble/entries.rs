//! Writes the rows of a sparse matrix.

use crate::solve::rows::{LANES, Row};

/// Destination of the column indices and weights of a run of consecutive rows.
pub(super) enum Entries<'a> {
    /// The part of the run's range in the matrix that has not been written yet.
    Part { indices: &'a mut [u32], data: &'a mut [f32] },
    /// A whole matrix, to which entries are appended.
    All { indices: Vec<u32>, data: Vec<f32> },
}

impl Entries<'_> {
    /// Appends entries; false if the run's range has no room for them.
    #[inline(always)]
    fn put(&mut self, columns: &[u32], weights: &[f32]) -> bool {
        match self {
            Self::All { indices, data } => {
                indices.extend_from_slice(columns);
                data.extend_from_slice(weights);
                true
            }
            Self::Part { indices, data } => {
                let n = columns.len();
                let (Some(to_indices), Some(to_data)) = (indices.split_off_mut(..n), data.split_off_mut(..n))
                else {
                    return false;
                };
                to_indices.copy_from_slice(columns);
                to_data.copy_from_slice(weights);
                true
            }
        }
    }

    /// Appends the entries of a row that `chosen(batch)` selects. Returns their number. `row`: `[n_batches]`.
    #[inline(always)]
    pub(super) fn put_row(&mut self, row: &[Row], chosen: impl Fn(usize) -> [bool; LANES]) -> u32 {
        let mut n = 0;
        for (batch, row) in row.iter().enumerate() {
            let columns: [u32; LANES] = std::array::from_fn(|k| (batch * LANES + k) as u32);
            let chosen = chosen(batch);
            // Fast path for whole batches, without a branch per lane.
            if chosen.iter().fold(true, |all, &one| all & one) && self.put(&columns, row) {
                n += LANES as u32;
                continue;
            }
            for k in (0..LANES).filter(|&k| chosen[k]) {
                n += u32::from(self.put(&columns[k..=k], &row[k..=k]));
            }
        }
        n
    }
}
