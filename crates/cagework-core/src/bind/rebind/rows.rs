//! Rows of weights brought up to date: those that an edit reaches are corrected in place, the others stay.

use glam::{DVec3, Vec3};

use crate::simd::dispatch;
use crate::solve::rows::{LANES, Row, ZERO};
use crate::solve::team::{Team, VERTEX_RUN};
use crate::weights::ReplacedRow;
use crate::weights::affine::Columns;
use crate::weights::assemble::{Assembled, GOOD_ENOUGH, RowFacts, restore};

use super::known::OfMoved;
use super::shares::{Felt, Shares};

/// A row that nothing else changes keeps its weights if the cage's move puts its vertex no further off than this, of the
/// cage's diagonal: a tenth of what a corrected row may miss by. Known corrections, gradients times that, are 1e-6 there where the
/// cage's edges are a fiftieth of the diagonal: a tenth of the threshold.
const UNMOVED: f64 = 2e-8;

/// A row that keeps fewer than one in so many of its entries is stored anew.
const FAR_FEWER: usize = 8;

/// What an edit does to the rows.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edit<'a> {
    /// The cage's vertices as they are now.
    pub(super) columns: &'a Columns,
    pub(super) n_columns: usize,
    /// Those that have moved, and where to, over the cage's diagonal.
    pub(super) moved: &'a [(usize, DVec3)],
    /// Rest positions of the rows' vertices.
    pub(super) points: &'a [Vec3],
    /// Corrections at them. `[n_batches of corrections][n_points]`
    pub(super) samples: &'a [&'a [Row]],
    pub(super) shares: &'a Shares,
    /// A weight that was not stored stays so below this: what the solver leaves, with either sign, where the weight is 0. One
    /// entry more, and the whole matrix is copied.
    pub(super) still_zero: f32,
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
    moments: Moments,
    indptr: &'a [u32],
    indices: &'a [u32],
}

impl Edit<'_> {
    /// Brings all rows up to date.
    pub(super) fn apply(&self, rows: &mut Assembled, is_outside: impl Fn(usize) -> bool + Sync, team: &Team) {
        let n_batches = self.columns.n_batches();
        let (indptr, indices, mut data) = rows.weights.parts_mut();
        let mut runs = Vec::new();
        for (number, facts) in rows.facts.chunks_mut(VERTEX_RUN).enumerate() {
            let first = number * VERTEX_RUN;
            let offset = indptr[first] as usize;
            let n = indptr[first + facts.len()] as usize - offset;
            let data = data.split_off_mut(..n).expect("the last row pointer is the number of weights");
            runs.push(Run { first, offset, data, facts, replaced: Vec::new() });
        }
        let moments = Moments::new(self);
        let shared = Shared { edit: *self, moments, indptr, indices };
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

impl Shared<'_> {
    /// Corrects a row that may be off, and says what it is like now.
    #[inline(always)]
    fn restored(&self, row: &mut [Row], point: Vec3, is_outside: bool, off: Off) -> RowFacts {
        if let Off::Little { sum, miss } = off {
            return RowFacts::of(row, 1.0 + sum, Some(miss));
        }
        let columns = self.edit.columns;
        let target = columns.scale(point.as_dvec3());
        let sums = match off {
            Off::Much => (f64::INFINITY, f64::INFINITY),
            _ => columns.sums(row, target),
        };
        let is_off = sums.1.max((sums.0 - 1.0).abs()) > GOOD_ENOUGH;
        let (sum, miss) = if is_off && !is_outside { restore(columns, row, target) } else { sums };
        RowFacts::of(row, sum, (!is_outside).then_some(miss))
    }
}

/// How far a row may be from summing to 1 and from its vertex, over the cage's diagonal.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Off {
    /// At most so far, but for f32 rounding, which is good enough.
    Little { sum: f64, miss: f64 },
    /// Further than is good enough.
    Much,
    /// To be measured.
    Unknown,
}

impl RowFacts {
    /// How far a row is off that changes its sum and its point by so much, and of which weights are cut off at 0.
    #[inline(always)]
    fn after(&self, sum: f64, way: DVec3, clipped: f64) -> Off {
        let (changed, moved) = (sum.abs() + clipped, way.length() + clipped);
        let (sum, miss) =
            (f64::from(self.sum_error) + changed, f64::from(self.error.unwrap_or(f32::INFINITY)) + moved);
        if sum.max(miss) <= GOOD_ENOUGH {
            Off::Little { sum, miss }
        } else if changed.max(moved) > GOOD_ENOUGH {
            Off::Much
        } else {
            Off::Unknown
        }
    }
}

/// What a unit of each correction adds to the sum of a row and to its point: sum, x, y, z.
struct Moments {
    /// `[n_corrections]`
    of_field: Vec<[f32; 4]>,
    /// `[n_known]`
    of_known: Vec<[f32; 4]>,
}

impl Moments {
    fn new(edit: &Edit<'_>) -> Self {
        let of_share = |share| {
            let (sum, point) = edit.columns.combined(share);
            [sum, point.x, point.y, point.z].map(|x| x as f32)
        };
        let of_field = edit.shares.iter().map(of_share).collect();
        Self { of_field, of_known: edit.shares.known.shares().map(of_share).collect() }
    }

    /// Of all that is felt.
    #[inline(always)]
    fn of(&self, felt: &Felt, of_known: &OfMoved) -> (f64, DVec3) {
        let mut moments = [0.0f32; 4];
        let known = self.of_known.iter().zip(of_known).map(|(of, value)| (of, *value));
        for (of, value) in known.chain(felt.iter().map(|(field, value)| (&self.of_field[field], value))) {
            for k in 0..4 {
                moments[k] += value * of[k];
            }
        }
        let [sum, x, y, z] = moments.map(f64::from);
        (sum, DVec3::new(x, y, z))
    }
}

impl Run<'_> {
    #[inline(always)]
    fn update(&mut self, shared: &Shared<'_>, n_batches: usize, is_outside: &impl Fn(usize) -> bool) {
        let Edit { points, samples, shares, resampled, .. } = shared.edit;
        let mut row = vec![ZERO; n_batches];
        let mut felt = Felt::new();
        let mut next = resampled.0.partition_point(|&v| (v as usize) < self.first);
        for k in 0..self.facts.len() {
            let v = self.first + k;
            shares.pick(&mut felt, samples.iter().map(|batch| &batch[v]));
            let range = shared.indptr[v] as usize..shared.indptr[v + 1] as usize;
            let indices = &shared.indices[range.clone()];
            let data = &mut self.data[range.start - self.offset..range.end - self.offset];
            let is_resampled = resampled.0.get(next) == Some(&(v as u32));
            let mut change = None;
            if is_resampled {
                row.copy_from_slice(&resampled.1[next * n_batches..(next + 1) * n_batches]);
                next += 1;
            } else {
                // Ways may cancel each other, but known corrections do not for that.
                let (mut way, mut most) = (DVec3::ZERO, 0.0);
                for &(column, moved) in shared.edit.moved {
                    let own = f64::from(weight_of(column, indices, data)) * moved;
                    (way, most) = (way + own, most + own.length());
                }
                if felt.is_empty() && most < UNMOVED {
                    let facts = &mut self.facts[k];
                    facts.error = facts.error.map(|error| error + way.length() as f32);
                    continue;
                }
                expand(indices, data, &mut row);
                // No hat value of a moved vertex is part of such a row: at its faces stencils are new, and rows resampled.
                let of_known = shares.known.add(shares.known.of_moved(&row), &mut row);
                // Of other rows small weights are dropped.
                if indices.len() == shared.edit.n_columns {
                    let (sum, moved) = shared.moments.of(&felt, &of_known);
                    change = Some((sum, way + moved));
                }
            }
            shares.add(&felt, &mut row);
            let clipped = clip(&mut row);
            if indices.len() < shared.edit.n_columns {
                forget_unstored(&mut row, indices, shared.edit.still_zero);
            }
            let outside = is_outside(v);
            let off = match change {
                Some((sum, way)) if !outside => self.facts[k].after(sum, way, f64::from(clipped)),
                _ => Off::Unknown,
            };
            self.facts[k] = shared.restored(&mut row, points[v], outside, off);
            // Rows of all columns stay what they are, but for vertices that are outside now.
            let n_nonzero = if is_full(indices) && !is_resampled { indices.len() } else { n_nonzeros(&row) };
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

/// Sets negative weights to 0; returns what they sum to, without the sign.
#[inline(always)]
fn clip(row: &mut [Row]) -> f32 {
    let mut lows = ZERO;
    for row in row.iter() {
        for lane in 0..LANES {
            lows[lane] = if row[lane] < lows[lane] { row[lane] } else { lows[lane] };
        }
    }
    if lows == ZERO {
        return 0.0;
    }
    let negative = row.iter_mut().flatten().filter(|w| **w < 0.0);
    negative.map(|w| -std::mem::take(w)).sum()
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
fn forget_unstored(row: &mut [Row], indices: &[u32], still_zero: f32) {
    let mut next = indices.iter().peekable();
    for (column, w) in (0u32..).zip(row.iter_mut().flatten()) {
        if next.next_if_eq(&&column).is_none() && *w < still_zero {
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
