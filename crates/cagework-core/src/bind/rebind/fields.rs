//! The old fields: those of the last whole bind, and what edits since have added.

use std::sync::Arc;

use crate::grid::NO_CELL;
use crate::solve::rows::{Row, ZERO};

use super::known::OfMoved;
use super::shares::{Felt, Shares};

/// What a cell that was outside began with.
#[derive(Clone, Debug, Default)]
pub(super) struct Extended {
    /// Index in the grid.
    pub(super) cell: u32,
    /// All columns, `[n_batches]`.
    pub(super) row: Vec<Row>,
    /// The moved vertices' columns as known corrections.
    pub(super) of_moved: OfMoved,
}

/// A correction of all columns: a few fields and how much of each every column takes.
#[derive(Clone, Debug)]
pub(super) struct Update {
    /// `[n_batches of fields][n_rows]`
    pub(super) fields: Vec<Vec<Row>>,
    pub(super) row_of: Arc<Vec<u32>>,
    pub(super) shares: Shares,
    /// What is corrected in cells that were outside, by cell.
    pub(super) extended: Vec<Extended>,
}

/// All columns' fields: those of the last whole bind, and the corrections since.
#[derive(Clone, Debug)]
pub(super) struct Fields {
    /// `[n_batches][n_rows]`
    base: Vec<Vec<Row>>,
    row_of: Arc<Vec<u32>>,
    /// How many of the updates there are in each row of the base already. `[n_rows]`
    included: Vec<u8>,
    updates: Vec<Update>,
}

impl Fields {
    /// Those of a whole bind, `[n_batches][n_rows]`.
    pub(super) fn new(base: Vec<Vec<Row>>, row_of: Arc<Vec<u32>>) -> Self {
        let included = vec![0; base.first().map_or(0, Vec::len)];
        Self { base, row_of, included, updates: Vec::new() }
    }

    /// Corrections since the whole bind.
    pub(super) fn n_updates(&self) -> usize {
        self.updates.len()
    }

    /// Adds a correction.
    pub(super) fn correct(&mut self, update: Update) {
        self.updates.push(update);
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let updates = self.updates.iter().flat_map(|update| {
            update.fields.iter().chain(update.extended.iter().map(|extended| &extended.row))
        });
        let rows: usize = self.base.iter().chain(updates).map(|rows| size_of_val(rows.as_slice())).sum();
        rows + self.included.len()
    }

    /// Weights of all columns in some cells; where one was outside, what is there, zeros, stays. They are put down in the base
    /// as well: the next edit is likely to be close by, and asks for them again. `out`: `[n_cells][n_batches]`
    ///
    /// Array by array: a cell's rows are far apart, and so those of several cells are on their way from memory at once.
    #[inline(always)]
    pub(super) fn read(&mut self, cells: &[u32], out: &mut [Row]) {
        let n_batches = self.base.len();
        let rows: Vec<u32> = cells.iter().map(|&cell| self.row_of[cell as usize]).collect();
        gather(&self.base, &rows, out);
        let included: Vec<usize> =
            rows.iter().map(|&row| self.included.get(row as usize).map_or(0, |&n| usize::from(n))).collect();
        let first = included.iter().copied().min().unwrap_or(self.updates.len());
        let mut felt = Felt::new();
        let mut row_of_before = self.updates[..first].last().map_or(&self.row_of, |update| &update.row_of);
        for (number, update) in self.updates.iter().enumerate().skip(first) {
            let missing: Vec<usize> = (0..cells.len()).filter(|&k| included[k] <= number).collect();
            let rows: Vec<u32> = missing.iter().map(|&k| update.row_of[cells[k] as usize]).collect();
            let n_fields = update.fields.len();
            let mut values = vec![ZERO; n_fields * rows.len()];
            gather(&update.fields, &rows, &mut values);
            for (place, (k, row)) in missing.into_iter().zip(rows).enumerate() {
                let out = &mut out[k * n_batches..][..n_batches];
                if row == NO_CELL {
                    // Outside at the time: whatever it was before does not count.
                    out.fill(ZERO);
                    continue;
                }
                let mut of_moved = update.shares.known.of_moved(out);
                if row_of_before[cells[k] as usize] == NO_CELL
                    && let Ok(k) = update.extended.binary_search_by_key(&cells[k], |extended| extended.cell)
                {
                    out.copy_from_slice(&update.extended[k].row);
                    of_moved = update.extended[k].of_moved;
                }
                update.shares.known.add(of_moved, out);
                update.shares.pick(&mut felt, values[place * n_fields..][..n_fields].iter());
                update.shares.add(&felt, out);
            }
            row_of_before = &update.row_of;
        }
        if first < self.updates.len() {
            for (batch, base) in self.base.iter_mut().enumerate() {
                for (&row, value) in rows.iter().zip(out.iter().skip(batch).step_by(n_batches)) {
                    if row != NO_CELL {
                        base[row as usize] = *value;
                    }
                }
            }
            for row in rows.into_iter().filter(|&row| row != NO_CELL) {
                self.included[row as usize] = self.updates.len() as u8;
            }
        }
    }
}

/// Rows of fields, one after the other; where there is none, what is there stays. `out`: `[n_rows][n_fields]`
#[inline(always)]
fn gather(fields: &[Vec<Row>], rows: &[u32], out: &mut [Row]) {
    for (k, field) in fields.iter().enumerate() {
        for (&row, out) in rows.iter().zip(out.iter_mut().skip(k).step_by(fields.len())) {
            if row != NO_CELL {
                *out = field[row as usize];
            }
        }
    }
}
