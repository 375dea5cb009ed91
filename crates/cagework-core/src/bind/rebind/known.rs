//! Corrections that need not be solved for.
//!
//! When the cage's vertex v moves by w, `sum h_j c_j` is the cell's place before and after, and `sum h_j` is 1. So corrections
//! d of all columns have `sum d_j c_j = -h_v w`: that combination of them is the old field of the vertex's own column, which is
//! zero on all faces that stay. To first order a column's correction is `-(grad h_j . w) h_v` on the faces of v (Hadamard's
//! variation of a domain), of which that field is the part with the same gradient everywhere; what is left of the others is a
//! tenth as large. Each moved vertex has such a field, and its right-hand side is what the field leaves of its equations.

use glam::DVec3;

use crate::solve::rows::{LANES, Row, ZERO};

use super::shares::add_scaled;

/// Moved vertices whose columns' fields are made use of: as many as a batch of moments has room for (`local::Residual`). What
/// others ask for is solved for.
pub(super) const MAX_KNOWN: usize = LANES - 4;

/// Vertices that move by less are as good as at rest: their residuals, as large as what earlier edits have left, say nothing of how
/// much of a field a column takes. Times [`take_out`](Known::take_out): 0.003 % of the cage's diagonal.
const LEAST_TIMES: f32 = 1e-3;

/// A field is like those before it where less than this is left of its squares: f32 rounding, some hundred times.
const ALIKE: f32 = 1e-8;

/// What the columns of those vertices are somewhere; zeros beyond.
pub(super) type OfMoved = [f32; MAX_KNOWN];

/// Known fields, sums of the old columns of moved vertices, and all columns' shares in them.
#[derive(Clone, Debug)]
pub(super) struct Known {
    /// Those of the moved vertices. `[at most MAX_KNOWN]`
    columns: Vec<usize>,
    /// For each field how many times each of these it is, and all columns' shares, `[n_batches]`.
    fields: Vec<(OfMoved, Vec<Row>)>,
}

impl Known {
    /// No fields yet, of vertices that have moved.
    pub(super) fn new(moved: &[(usize, DVec3)]) -> Self {
        let columns = moved.iter().take(MAX_KNOWN).map(|&(column, _)| column).collect();
        Self { columns, fields: Vec::new() }
    }

    /// The moved vertices' columns of a row of all columns.
    #[inline(always)]
    pub(super) fn of_moved(&self, row: &[Row]) -> OfMoved {
        let mut values = [0.0; MAX_KNOWN];
        for (value, &column) in values.iter_mut().zip(&self.columns) {
            *value = row[column / LANES][column % LANES];
        }
        values
    }

    /// Adds all columns' shares to a row, `[n_batches]`, where the moved vertices' old columns have these values. Returns the
    /// fields' values.
    #[inline(always)]
    pub(super) fn add(&self, of_moved: OfMoved, row: &mut [Row]) -> OfMoved {
        let mut values = [0.0; MAX_KNOWN];
        for (value, (times, share)) in values.iter_mut().zip(&self.fields) {
            *value = times.iter().zip(of_moved).map(|(times, of)| times * of).sum();
            add_scaled(row, share, *value);
        }
        values
    }

    /// Each field's shares, `[n_batches]`.
    pub(super) fn shares(&self) -> impl Iterator<Item = &[Row]> {
        self.fields.iter().map(|(_, share)| share.as_slice())
    }

    /// Takes out of residuals what known fields meet, as much of each as leaves least, in squares. `values`: of each unknown the
    /// columns' residuals, `[n_batches]`, and one more row, which ends with what `times` the moved vertices' fields are the
    /// solutions for, and with zeros then.
    #[inline(always)]
    pub(super) fn take_out(&mut self, values: &mut [Row], n_batches: usize, times: &[f32]) {
        let mut fields = vec![[0.0; MAX_KNOWN]; self.columns.len()];
        for (i, &times) in times.iter().enumerate().take(fields.len()) {
            fields[i][i] = times;
        }
        let mut squares_before = ZERO;
        for row in values.iter().skip(n_batches).step_by(n_batches + 1) {
            for lane in 0..LANES {
                squares_before[lane] += row[lane] * row[lane];
            }
        }
        for i in 0..fields.len() {
            let own = |row: &[Row]| row[n_batches][LANES - MAX_KNOWN + i];
            let mut share = vec![ZERO; n_batches + 1];
            for row in values.chunks_exact(n_batches + 1) {
                add_scaled(&mut share, row, own(row));
            }
            let squares = own(&share);
            let least = (ALIKE * squares_before[LANES - MAX_KNOWN + i]).max(f32::MIN_POSITIVE);
            if squares <= least || fields[i][i] < LEAST_TIMES {
                continue;
            }
            share.iter_mut().flatten().for_each(|w| *w /= squares);
            for row in values.chunks_exact_mut(n_batches + 1) {
                let value = own(row);
                add_scaled(row, &share, -value);
            }
            let (done, later) = fields.split_at_mut(i + 1);
            for (later, times) in later.iter_mut().zip(&share[n_batches][LANES - MAX_KNOWN + i + 1..]) {
                for (later, own) in later.iter_mut().zip(done[i]) {
                    *later -= times * own;
                }
            }
            share.truncate(n_batches);
            self.fields.push((fields[i], share));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Some numbers between -1 and 1.
    fn some(k: usize) -> f32 {
        2.0 * (43_758.547 * (12.9898 * k as f32).sin()).rem_euclid(1.0) - 1.0
    }

    /// f32 rounding of sums of 40 products.
    const ROUNDED: f32 = 2e-5;

    /// Columns whose residuals are sums of what known fields leave: nothing is left of them, and their corrections are the same
    /// sums of the fields, whatever those are somewhere.
    #[test]
    fn what_known_fields_meet_is_taken_out_and_added() {
        let (n_columns, moved) = (2 * LANES, [3, 9, 14]);
        let ways: Vec<(usize, DVec3)> = moved.iter().map(|&column| (column, DVec3::X)).collect();
        let times = [2.0, 0.5, 1.0];
        let amount = |column: usize, i: usize| some(100 + 7 * column + i);
        let mut values: Vec<Row> = (0..40)
            .flat_map(|k| {
                let left: [f32; 3] = std::array::from_fn(|i| times[i] * some(3 * k + i));
                let mut row = vec![ZERO; 3];
                for column in 0..n_columns {
                    row[column / LANES][column % LANES] = (0..3).map(|i| amount(column, i) * left[i]).sum();
                }
                row[2][4..7].copy_from_slice(&left);
                row
            })
            .collect();
        let mut known = Known::new(&ways);
        known.take_out(&mut values, 2, &times);
        let largest = values.iter().flatten().fold(0.0, |a: f32, b| a.max(b.abs()));
        assert!(largest <= ROUNDED, "{largest:e} is left");

        let old: Vec<Row> = (0..2).map(|batch| std::array::from_fn(|lane| some(8 * batch + lane))).collect();
        let mut row = old.clone();
        let of_moved = known.of_moved(&old);
        assert_eq!(of_moved[..3], moved.map(|column| old[column / LANES][column % LANES]));
        known.add(of_moved, &mut row);
        for column in 0..n_columns {
            let (batch, lane) = (column / LANES, column % LANES);
            let expected: f32 = (0..3).map(|i| amount(column, i) * times[i] * of_moved[i]).sum();
            let added = row[batch][lane] - old[batch][lane];
            assert!((added - expected).abs() <= ROUNDED, "column {column}: {added} instead of {expected}");
        }
    }

    /// One field is twice the other: nothing is left of it to take, and rounding is not taken for it.
    #[test]
    fn fields_that_are_alike_count_once() {
        let mut values: Vec<Row> = (0..40)
            .flat_map(|k| {
                let left = some(k);
                let mut row = vec![[some(100 + k); LANES], ZERO];
                row[1][4..6].copy_from_slice(&[left, 2.0 * left]);
                row
            })
            .collect();
        let mut known = Known::new(&[(0, DVec3::X), (1, DVec3::X)]);
        known.take_out(&mut values, 1, &[1.0, 1.0]);
        assert_eq!(known.shares().count(), 1);
        let mut row = [[1.0; LANES]];
        known.add([1.0, 1.0, 0.0, 0.0], &mut row);
        assert!(row[0].iter().all(|w| w.abs() < 2.0), "{row:?}");
    }

    #[test]
    fn vertices_at_rest_have_no_field() {
        let mut values = vec![[1.0; LANES]; 2 * 10];
        let mut known = Known::new(&[(0, DVec3::X * 1e-7)]);
        known.take_out(&mut values, 1, &[1e-4]);
        assert_eq!((known.shares().count(), values), (0, vec![[1.0; LANES]; 2 * 10]));
    }

    #[test]
    fn of_more_vertices_only_the_first_are_known() {
        let ways: Vec<(usize, DVec3)> = (0..MAX_KNOWN + 3).map(|column| (column, DVec3::Y)).collect();
        let row = [[1.0; LANES]; 2];
        assert_eq!(Known::new(&ways).of_moved(&row), [1.0; MAX_KNOWN]);
        assert_eq!(Known::new(&ways[..2]).of_moved(&row).iter().sum::<f32>(), 2.0);
    }
}
