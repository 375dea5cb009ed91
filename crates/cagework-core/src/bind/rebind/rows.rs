//! Rows of weights brought up to date: those that an edit reaches are corrected in place, the others stay.

use glam::Vec3;

use crate::cage::Cage;
use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::{Team, VERTEX_RUN};
use crate::weights::ReplacedRow;
use crate::weights::affine::Columns;
use crate::weights::assemble::{Assembled, GOOD_ENOUGH, RowFacts, restore};

use super::local::{Felt, Share, add_felt, felt_in};

/// A row that nothing else changes keeps its weights if the cage's move puts its vertex no further off than this, of the
/// cage's diagonal: a tenth of what a corrected row may miss by.
const UNMOVED: f64 = 2e-8;

/// A weight that was not stored stays so below this: what the solver leaves, with either sign, where the weight is 0.
const STILL_ZERO: f32 = 1e-7;

/// A row that keeps fewer than one in so many of its entries is stored anew.
const FAR_FEWER: usize = 8;

/// What an edit does to the rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edit<'a> {
    /// The cage before and after.
    pub(super) cages: [&'a Cage; 2],
    /// Rest positions of the rows' vertices.
    pub(super) points: &'a [Vec3],
    /// Corrections at them. `[n_batches of corrections][n_points]`
    pub(super) samples: &'a [&'a [Row]],
    /// `[n_corrections]`
    pub(super) shares: &'a [Share],
    /// Vertices whose old weights are sampled anew, ascending, and those rows: `[n_resampled][n_batches]`.
    pub(super) resampled: (&'a [u32], &'a [Row]),
}

/// The rows of one run of vertices.
struct Run<'a> {
    first: usize,
    /// Entries of the matrix before the run's.
    offset: usize,
    data: &'a mut [f32],
    facts: &'a mut [RowFacts],
    /// Rows whose entries have become others.
    replaced: Vec<ReplacedRow>,
}

/// What all runs look at.
struct Shared<'a> {
    edit: Edit<'a>,
    columns: Columns,
    /// Moved vertices of the cage, and how far over its diagonal.
    moved: Vec<(usize, f64)>,
    indptr: &'a [u32],
    indices: &'a [u32],
}

impl Edit<'_> {
    /// Brings all rows up to date.
    pub(super) fn apply(&self, rows: &mut Assembled, is_outside: impl Fn(usize) -> bool + Sync, team: &Team) {
        let [before, after] = self.cages;
        let columns = Columns::new(after);
        let n_batches = columns.n_batches();
        let way = |(column, (a, b)): (usize, (&Vec3, &Vec3))| {
            (a != b).then(|| (column, f64::from(a.distance(*b)) / f64::from(after.diagonal())))
        };
        let moved = before.positions().iter().zip(after.positions()).enumerate().filter_map(way).collect();
        let (indptr, indices, mut data) = rows.weights.parts_mut();
        let mut runs = Vec::new();
        for (number, facts) in rows.facts.chunks_mut(VERTEX_RUN).enumerate() {
            let first = number * VERTEX_RUN;
            let offset = indptr[first] as usize;
            let n = indptr[first + facts.len()] as usize - offset;
            let data = data.split_off_mut(..n).expect("the last row pointer is the number of weights");
            runs.push(Run { first, offset, data, facts, replaced: Vec::new() });
        }
        let shared = Shared { edit: *self, columns, moved, indptr, indices };
        team.each_mut(&mut runs, |run| {
            dispatch(
                #[inline(always)]
                || run.update(&shared, n_batches, &is_outside),
            );
        });
        let replaced: Vec<ReplacedRow> = runs.into_iter().flat_map(|run| run.replaced).collect();
        if !replaced.is_empty() {
            rows.weights = rows.weights.with_replaced(&replaced);
        }
    }
}

impl Run<'_> {
    #[inline(always)]
    fn update(&mut self, shared: &Shared<'_>, n_batches: usize, is_outside: &impl Fn(usize) -> bool) {
        let Edit { points, samples, shares, resampled, .. } = shared.edit;
        let mut row = vec![ZERO; n_batches];
        let mut felt = Felt::with_capacity(shares.len());
        let mut next = resampled.0.partition_point(|&v| (v as usize) < self.first);
        for k in 0..self.facts.len() {
            let v = self.first + k;
            felt.clear();
            felt_in(shares, &mut felt, samples.iter().map(|batch| &batch[v]));
            let range = shared.indptr[v] as usize..shared.indptr[v + 1] as usize;
            let indices = &shared.indices[range.clone()];
            let data = &mut self.data[range.start - self.offset..range.end - self.offset];
            let is_resampled = resampled.0.get(next) == Some(&(v as u32));
            if is_resampled {
                row.copy_from_slice(&resampled.1[next * n_batches..(next + 1) * n_batches]);
                next += 1;
            } else {
                let way = |&(column, way): &(usize, f64)| f64::from(weight_of(column, indices, data)) * way;
                let off = if felt.is_empty() { shared.moved.iter().map(way).sum() } else { f64::INFINITY };
                if off < UNMOVED {
                    let facts = &mut self.facts[k];
                    facts.error = facts.error.map(|error| error + off as f32);
                    continue;
                }
                expand(indices, data, &mut row);
            }
            add_felt(&mut row, &felt);
            for w in &mut row {
                *w = w.map(|w| if w > 0.0 { w } else { 0.0 });
            }
            if indices.len() < shared.edit.cages[1].n_vertices() {
                forget_unstored(&mut row, indices);
            }
            let target = shared.columns.scale(points[v].as_dvec3());
            let outside = is_outside(v);
            // Far from the edit the sums still hold: corrections are harmonic, as what they correct is.
            let (mut sum, mut miss) = shared.columns.sums(&row, target);
            if !outside && miss.max((sum - 1.0).abs()) > GOOD_ENOUGH {
                (sum, miss) = restore(&shared.columns, &mut row, target);
            }
            self.facts[k] = RowFacts::of(&row, sum, (!outside).then_some(miss));
            let n_nonzero = n_nonzeros(&row);
            // As outside the cage, where only the closest triangle's corners count.
            let is_other = FAR_FEWER * n_nonzero < indices.len();
            if is_other || !store(&row, n_nonzero, indices, data) {
                let is_stored =
                    |&(c, w): &(u32, f32)| w != 0.0 || !is_other && indices.binary_search(&c).is_ok();
                let entries = (0u32..).zip(row.iter().flatten().copied()).filter(is_stored);
                let (columns, weights) = entries.unzip();
                self.replaced.push((v as u32, columns, weights));
            }
        }
    }
}

/// A row's weight of a column.
#[inline(always)]
fn weight_of(column: usize, indices: &[u32], data: &[f32]) -> f32 {
    // Most rows have all columns.
    let found = if indices.get(column) == Some(&(column as u32)) {
        Some(column)
    } else {
        indices.binary_search(&(column as u32)).ok()
    };
    found.map_or(0.0, |k| data[k])
}

/// Whether a row has all columns up to its last.
#[inline(always)]
fn is_full(indices: &[u32]) -> bool {
    indices.last().is_some_and(|&last| last as usize + 1 == indices.len())
}

/// A stored row as one of batches; zeros elsewhere.
#[inline(always)]
fn expand(indices: &[u32], data: &[f32], row: &mut [Row]) {
    row.fill(ZERO);
    if is_full(indices) {
        for (row, data) in row.iter_mut().zip(data.chunks(LANES)) {
            match data.first_chunk() {
                Some(lanes) => *row = *lanes,
                None => row[..data.len()].copy_from_slice(data),
            }
        }
    } else {
        for (&column, &w) in indices.iter().zip(data) {
            row[column as usize / LANES][column as usize % LANES] = w;
        }
    }
}

/// Weights of a row that are not 0.
#[inline(always)]
fn n_nonzeros(row: &[Row]) -> usize {
    let mut lanes = [0u32; LANES];
    for row in row {
        for k in 0..LANES {
            lanes[k] += u32::from(row[k] != 0.0);
        }
    }
    lanes.iter().sum::<u32>() as usize
}

/// Sets weights to 0 that are nearly so and were not stored.
#[inline(always)]
fn forget_unstored(row: &mut [Row], indices: &[u32]) {
    let mut next = indices.iter().peekable();
    for (column, w) in (0u32..).zip(row.iter_mut().flatten()) {
        if next.next_if_eq(&&column).is_none() && *w < STILL_ZERO {
            *w = 0.0;
        }
    }
}

/// Writes a row over the stored one, unless it has more entries than that one. Weights that have become 0 stay entries: the
/// next edit may bring them back.
#[inline(always)]
fn store(row: &[Row], n_nonzero: usize, indices: &[u32], data: &mut [f32]) -> bool {
    if is_full(indices) {
        let (whole, lanes) = (data.len() / LANES, data.len() % LANES);
        if row[whole..].iter().flatten().skip(lanes).any(|&w| w != 0.0) {
            return false;
        }
        for (data, row) in data.chunks_mut(LANES).zip(row) {
            match data.first_chunk_mut() {
                Some(lanes) => *lanes = *row,
                None => data.copy_from_slice(&row[..data.len()]),
            }
        }
        return true;
    }
    let of = |&column: &u32| row[column as usize / LANES][column as usize % LANES];
    if indices.iter().filter(|c| of(c) != 0.0).count() < n_nonzero {
        return false;
    }
    for (column, w) in indices.iter().zip(data) {
        *w = of(column);
    }
    true
}
